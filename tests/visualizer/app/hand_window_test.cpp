// SPDX-License-Identifier: Apache-2.0
// Controller, emulator and window as a user without a device has them: pointer events alone cut.
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "tests/support/process.hpp"
#include "tests/visualizer/app/window_fixture.hpp"
#include "visualizer/scene/session.hpp"

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
    controller.emplace(std::vector<std::string>{kPrograms + "/kerf-controller", "--scene",
                                                cut_scene(screen.folder), "--torque-scale",
                                                "0.342,0.342,0.342", "--port", "socket:" + port,
                                                "--name", "test", "--report", report.string()},
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
    // A busy machine may latch a fault, which parking clears.
    for (int tries = 0; tries < 3; ++tries) {
      act("mousemove 240 150" + kCut);
      if (!Bench::faulted()) break;
      act("key k sleep 5");
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
