// SPDX-License-Identifier: Apache-2.0
// Controller, emulator and window as a user without a device has them: pointer events alone cut.
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <doctest/doctest.h>

#include "shared/volume/checksum.hpp"
#include "tests/json.hpp"
#include "tests/support/process.hpp"
#include "tests/visualizer/app/window_fixture.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf::hand_window_test {

using namespace kerf::test;
using namespace std::chrono_literals;

namespace {

const std::string kPrograms = KERF_TEST_BIN;

/// A coarse tooth and a ball of 1 mm that cuts fast.
std::string cut_scene(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "cut.toml";
  std::ofstream(path) << "[[volume]]\nfile = \"phantom\"\nsize = [48, 48, 32]\niso = 0.45\n"
                         "[[tool]]\nname = \"ball\"\nshape = \"ball\"\nradius_mm = 1\n"
                         "[force]\nstiffness_n_per_mm = 0.4\n"
                         "[cut]\nmachinability_mm3_per_s_n = 20\n";
  return path.string();
}

/// All three, on a screen of their own.
struct Bench {
  Screen screen;
  std::string hand = (screen.folder / "hand").string();
  std::filesystem::path report = screen.folder / "report.json";
  std::optional<Process> emulator, controller, window;

  Bench() {
    const std::string port = (screen.folder / "port").string();
    emulator.emplace(std::vector{kPrograms + "/kerf-emulator", std::string("--socket"), port,
                                 std::string("--hand-socket"), hand},
                     screen.folder / "emulator.log");
    controller.emplace(
        std::vector<std::string>{kPrograms + "/kerf-controller", "--scene",
                                 cut_scene(screen.folder), "--torque-scale", "0.342,0.342,0.342",
                                 "--port", "socket:" + port, "--name", "test", "--pedal",
                                 "--report", report.string()},
        screen.folder / "controller.log");
    window.emplace(arguments(), screen.folder / "window.log");
    REQUIRE(said(*window, "the hand is yours"));
  }
  std::vector<std::string> arguments() const {
    return {kPrograms + "/kerf-visualizer",
            "--name",
            "test",
            "--mute",
            "--size",
            "480x360",
            "--hand-socket",
            hand};
  }
  static bool said(const Process& program, const std::string& words) {
    const bool heard =
        eventually([&] { return program.output().find(words) != std::string::npos; }, 30s);
    INFO(program.output());
    CHECK(heard);
    return heard;
  }
  /// Whether a fault holds the motors off.
  static bool faulted() {
    kerf::Session session("test");
    constexpr std::uint16_t kFault = 5;
    return session.latest() && session.latest()->phase == kFault;
  }
  /// What is left of the tooth, once it stays so for a moment.
  static std::uint64_t tooth() {
    kerf::Session session("test");
    return kerf::density_hash(session.contents()[0].density);
  }
  static kerf::TickRecord tick() {
    kerf::Session session("test");
    REQUIRE(session.latest());
    return *session.latest();
  }
  /// Where the tip comes to rest, in mm.
  static std::array<float, 3> place() {
    std::array<float, 3> last{}, now{};
    CHECK(eventually(
        [&] {
          last = now;
          act("sleep 0.2");
          const kerf::TickRecord at = tick();
          for (std::size_t i = 0; i < 3; ++i) now[i] = static_cast<float>(at.position_mm[i]);
          return apart_mm(last, now) < 0.01F;
        },
        20s));
    return now;
  }
  static float apart_mm(const std::array<float, 3>& a, const std::array<float, 3>& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  }
  static bool pressed() { return (tick().flags & kerf::kFlagButton1) != 0; }
  /// Holds the left button over this pixel until the bur cuts there, 5 mm deeper than the tip's
  /// start; the button stays down. A busy machine may latch a fault, which parking clears, or show
  /// a frame so late that it ends the press.
  static void press(int x, int y) {
    const std::string there = "mousemove " + std::to_string(x) + " " + std::to_string(y);
    const std::uint64_t before = tooth();
    for (int tries = 0; tries < 8; ++tries) {
      act(there + " sleep 0.3 mousedown 1");
      if (eventually([&] { return tooth() != before; }, 2s)) return;
      let_go();
      if (faulted()) act("key k sleep 5");
      act(there + " sleep 0.2 click --repeat 4 --delay 10 4 sleep 0.3");
    }
    FAIL("nothing was cut");
  }
  static void let_go() {
    act("mouseup 1");
    CHECK(eventually([] { return !pressed(); }, 10s));
  }
  /// The button is let go, and nothing is cut in the next half second.
  static void check_rests() {
    CHECK(eventually([] { return !pressed(); }, 10s));
    const std::uint64_t before = tooth();
    act("sleep 0.5");
    CHECK_FALSE(pressed());
    CHECK(tooth() == before);
  }
  /// The tooth becomes this one.
  static void check_becomes(std::uint64_t wanted) {
    CHECK(eventually([&] { return tooth() == wanted; }, 10s));
  }
  /// Ends the run; what the controller counted.
  double removed_mm3() {
    controller->signal(SIGTERM);
    CHECK(controller->wait() <= 1);  // 1: a busy machine came too late, and a fault latched
    return kerf::test::read_json_file(report)["removed_mm3"].get<double>();
  }
};

/// 5 mm deeper than the pointer came, then a press of a second in which it moves a little.
const std::string kCut =
    " sleep 0.2 click --repeat 20 --delay 10 4 sleep 0.2 mousedown 1 sleep 0.4"
    " mousemove_relative -- 8 0 sleep 0.2 mousemove_relative -- -8 4 sleep 0.2"
    " mousemove_relative -- 4 -4 sleep 0.2 mouseup 1";

}  // namespace

TEST_CASE("pointer events cut where the tooth is, and nowhere else") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;
  SUBCASE("over the crown") {
    // A busy machine may latch a fault, which parking clears, or end the press early.
    const std::uint64_t whole = Bench::tooth();
    for (int tries = 0; tries < 3 && Bench::tooth() == whole; ++tries) {
      if (Bench::faulted()) act("key k sleep 5");
      act("mousemove 240 150" + kCut);
    }
    CHECK(bench.removed_mm3() > 0.1);
  }
  SUBCASE("beside the tooth the same strokes cut air") {
    act("mousemove 440 40" + kCut);
    CHECK(bench.removed_mm3() == 0.0);
  }
  SUBCASE("a pointer that has not come, or is a panel's, leaves the hand at its start") {
    act("mousemove 700 500" + kCut);  // outside
    act("mousemove 60 330" + kCut);   // over the controls
    CHECK(bench.removed_mm3() == 0.0);
  }
}

TEST_CASE("a press ends with whatever takes the pointer or the window away, and is made anew") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;
  const OtherWindow other({320, 60, 150, 120});
  const std::string find = "search --name 'kerf: test' ";
  act("mousemove 240 150 sleep 0.2 click --repeat 20 --delay 10 4 sleep 0.3");
  struct Way {
    const char* name;
    std::string away, back;
  };
  const Way ways[] = {
      {"outside", "mousemove 700 500", "mousemove 240 150"},
      {"along the edge and out", "mousemove 240 359 mousemove 240 400", "mousemove 240 150"},
      {"another window lies there", "mousemove 400 120", "mousemove 240 150"},
      {"a panel", "mousemove 60 330", "mousemove 240 150"},
      {"the right button, up again", "mousedown 3 sleep 0.1 mouseup 3", "mousemove 240 151"},
      {"the right button, up after the left one", "mousedown 3 sleep 0.1 mouseup 1",
       "mousemove 241 151 sleep 0.1 mouseup 3"},
      {"the middle button", "mousedown 2", "mouseup 2"},
      {"shift, and no motion", "keydown shift sleep 0.1", "keyup shift mousemove 240 151"},
      {"another window has the focus", find + "windowfocus sleep 0.2", ""},
      {"taken off the screen", find + "windowunmap", find + "windowmap sleep 0.3"},
  };
  int x = 228;
  for (const Way& way : ways) {
    CAPTURE(std::string(way.name));
    Bench::press(x += 4, 150);
    act(way.away);
    if (way.back.empty()) other.take_focus();
    act("sleep 0.1");
    Bench::check_rests();
    if (!way.back.empty()) act(way.back);
    Bench::check_rests();
    act("mouseup 1");
    Bench::check_rests();
  }
  SUBCASE("the window hangs") {
    Bench::press(240, 156);
    bench.window->signal(SIGSTOP);
    act("sleep 0.2");
    Bench::check_rests();
    bench.window->signal(SIGCONT);
    act("sleep 0.2");
    Bench::check_rests();  // the button is still down
  }
  SUBCASE("the window is killed") {
    Bench::press(240, 156);
    bench.window->signal(SIGKILL);
    act("sleep 0.1");
    Bench::check_rests();
  }
  act("mouseup 1");
}

TEST_CASE(
    "only a press cuts: not a hand that hovers deep, is let go, walks to a list, or sees twice") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;
  const std::uint64_t whole = Bench::tooth();
  act("mousemove 260 150 sleep 0.2 click --repeat 24 --delay 10 4 sleep 0.5 "
      "mousemove_relative -- 6 0 sleep 0.3 mousemove_relative -- -12 4 sleep 0.3");
  CHECK(Bench::tooth() == whole);
  Bench::press(260, 150);
  act("mouseup 1");
  Bench::check_rests();
  const auto place = [] {
    const kerf::TickRecord tick = Bench::tick();
    return std::array{tick.position_mm[0], tick.position_mm[1], tick.position_mm[2]};
  };
  const auto before = place();
  act("key t sleep 0.5");
  const auto after = place();
  for (std::size_t i = 0; i < 3; ++i) CHECK(std::abs(after[i] - before[i]) < 0.1);
  act("key t sleep 0.3");
  const std::uint64_t once = Bench::tooth();
  act("mousemove 200 200 sleep 0.1 mousemove 60 330 sleep 0.5");
  CHECK(Bench::tooth() == once);
  // The pedal alone; a late frame of a busy machine ends its press.
  bool pressed = false;
  for (int tries = 0; tries < 8 && !pressed; ++tries) {
    act("keyup space mousemove 240 170 sleep 0.3 keydown space");
    pressed = eventually(Bench::pressed, 2s);
  }
  CHECK(pressed);
  act("mousemove 700 500");
  Bench::check_rests();
  act("keyup space");
}

TEST_CASE(
    "a pointer that jumps into the window leads at once, and one that it opened under does not") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;  // the pointer lies in the middle of the screen, beside the window
  const OtherWindow another({1200, 900, 40, 40});  // the pointer stays while the window is gone
  const auto start = Bench::place();
  act("mousemove 360 200");
  CHECK(eventually([&] { return Bench::apart_mm(start, Bench::place()) > 1.0F; }, 10s));
  bench.window.reset();
  CHECK(eventually([&] { return Bench::apart_mm(start, Bench::place()) < 1.0F; }, 20s));
  bench.window.emplace(bench.arguments(), bench.screen.folder / "second.log");
  REQUIRE(Bench::said(*bench.window, "the hand is yours"));
  act("sleep 1");
  CHECK(Bench::apart_mm(start, Bench::place()) < 1.0F);
  act("mousemove_relative 4 0");
  CHECK(eventually([&] { return Bench::apart_mm(start, Bench::place()) > 1.0F; }, 10s));
}

TEST_CASE("the hand is at the pointer after every resize, zoom, move and full screen") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;
  // What brings the hand to the pointer moves it no more.
  const auto check_at_pointer = [&] {
    const auto before = Bench::place();
    act("key g");
    CHECK(Bench::apart_mm(before, Bench::place()) < 0.1F);
  };
  const std::string sized = "search --name 'kerf: test' windowsize ";
  act(sized + "640 480 sleep 0.5 mousemove 500 60 sleep 0.2 mousemove 510 100");
  check_at_pointer();
  const std::string wheel = "keydown ctrl click --repeat ";
  for (const std::string& way :
       {sized + "1280 960", std::string("mousemove 600 330"),
        sized + "640 480 sleep 0.5 mousemove 460 140", sized + "640 240",
        "mousemove 330 110 sleep 0.3 " + sized + "480 360", sized + "900 700",
        "mousemove 560 200 sleep 0.3 " + wheel + "4 4 keyup ctrl", wheel + "7 5 keyup ctrl",
        std::string("mousemove 1100 800 mousemove 500 220"),
        "mousemove 700 400 sleep 0.3 " + sized + "480 360 windowmove 500 300 sleep 0.5",
        std::string("key F11"), std::string("mousemove 800 420 sleep 0.3 key F11"),
        std::string("key F11 sleep 0.7 mousemove 200 700 sleep 0.3 key F11 sleep 0.5 "
                    "mousemove 760 450")}) {
    CAPTURE(way);
    act(way + " sleep 0.7");
    check_at_pointer();
  }
}

TEST_CASE("z takes back one press, shift and z makes it again, though the bur never leaves") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;
  act("mousemove 240 150 sleep 0.2 click --repeat 20 --delay 10 4 sleep 0.3");
  std::array<std::uint64_t, 4> tooth{Bench::tooth()};
  for (std::size_t i = 1; i < tooth.size(); ++i) {
    Bench::press(232 + 6 * static_cast<int>(i), 150);
    Bench::let_go();
    tooth[i] = Bench::tooth();
  }
  for (std::size_t i = tooth.size() - 1; i-- > 0;) {
    act("key z");
    Bench::check_becomes(tooth[i]);
  }
  for (std::size_t i = 1; i < tooth.size(); ++i) {
    act("key shift+z");
    Bench::check_becomes(tooth[i]);
  }
  act("mousedown 1 sleep 0.3 key z sleep 0.5");  // while a press is held: it ends
  Bench::check_rests();
  act("mouseup 1");
}

TEST_CASE("windows and emulators come and go, and each is told") {
  if (!have("Xvfb") || !have("xdotool")) return;
  Bench bench;
  Process second(bench.arguments(), bench.screen.folder / "second.log");
  CHECK(Bench::said(second, "another window leads it"));
  bench.window.reset();
  CHECK(Bench::said(second, "the hand is yours"));
  bench.emulator.reset();
  CHECK(Bench::said(second, "the emulator has gone"));
}

}  // namespace kerf::hand_window_test
