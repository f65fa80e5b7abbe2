// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/process.hpp"
#include "tests/visualizer/app/window_fixture.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/scene/appearance.hpp"

namespace kerf::window_test {

using namespace kerf::test;
namespace fs = std::filesystem;

namespace {

/// Pixels of a warning's ground.
int warning_pixels(const RgbPicture& picture) {
  int count = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
    const int red = picture.rgb[i], green = picture.rgb[i + 1], blue = picture.rgb[i + 2];
    count += red > 100 && red < 140 && green > 40 && green < 75 && blue < 25 ? 1 : 0;
  }
  return count;
}

/// Where the slices are, and no other panel.
std::vector<std::uint8_t> right_edge(const RgbPicture& picture) {
  const auto width = static_cast<std::size_t>(picture.size.width);
  std::vector<std::uint8_t> edge;
  for (std::size_t y = 0; y < static_cast<std::size_t>(picture.size.height) / 2; ++y) {
    const auto row = picture.rgb.begin() + static_cast<std::ptrdiff_t>(y * width * 3);
    edge.insert(edge.end(), row + static_cast<std::ptrdiff_t>(width * 3 - 80 * 3),
                row + static_cast<std::ptrdiff_t>(width * 3));
  }
  return edge;
}

void click(const std::string& at) {
  act("mousemove " + at + " sleep 0.2 mousedown 1 sleep 0.2 mouseup 1");
}

}  // namespace

TEST_CASE("a window without a size has room for its panels, at its screen's scale, or fills it") {
  if (!have("Xvfb") || !have("xdotool")) return;
  struct Case {
    const char* screen;
    int dots_per_inch;
    PictureSize size;
  };
  for (const Case& one : {Case{"1280x960", 96, {1280, 800}}, Case{"1024x600", 96, {1024, 600}},
                          Case{"2600x1300", 144, {1920, 1200}}}) {
    CAPTURE(std::string(one.screen));
    const Screen screen(one.screen);
    const DisplayDensity density(one.dots_per_inch);
    const Controller controller;
    Process window({KERF_TEST_BIN "/kerf-visualizer", "--name", "test", "--mute"},
                   screen.folder / "said");
    CHECK(seen_size() == one.size);
  }
}

TEST_CASE("F11 and --full-screen fill the monitor, F11 gives the window back where it was") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  const Controller controller;
  std::vector<std::string> words{
      KERF_TEST_BIN "/kerf-visualizer", "--name", "test", "--mute", "--size", "480x360"};
  const std::string find = "search --name 'kerf: test' ";
  constexpr PictureSize kWindow{480, 360}, kScreen{1280, 960};
  const auto becomes = [](PictureSize size) {
    return eventually([&] { return seen_size() == size; }, std::chrono::seconds(20));
  };
  SUBCASE("by the key") {
    Process window(words, screen.folder / "said");
    CHECK(seen_size() == kWindow);
    act(find + "windowmove 300 200 sleep 0.5 mousemove 500 400");
    for (int times = 0; times < 2; ++times) {
      act("key F11");
      CHECK(becomes(kScreen));
      act("key F11");
      CHECK(becomes(kWindow));
    }
    CHECK(seen_place() == std::array{300, 200});
    act("key q");
    CHECK(window.wait() == 0);
  }
  SUBCASE("by the option") {
    words.insert(words.end(), {"--full-screen", "--monitor", "1"});
    Process window(words, screen.folder / "said");
    CHECK(becomes(kScreen));
    act("mousemove 500 400 key F11");
    CHECK(becomes(kWindow));
    CHECK(seen_place() == std::array{400, 300});  // in the middle
    act("key q");
    CHECK(window.wait() == 0);
  }
  SUBCASE("a monitor that is unplugged leaves a window, which fills it again once it is back") {
    words.emplace_back("--full-screen");
    Process window(words, screen.folder / "said");
    CHECK(becomes(kScreen));
    act("mousemove 100 100");
    {
      const UnpluggedMonitor unplugged;
      CHECK(becomes(kWindow));
      act("key F11");  // there is none to fill
      CHECK(seen_size() == kWindow);
    }
    act("sleep 0.5 key F11");
    CHECK(becomes(kScreen));
    act("key q");
    CHECK(window.wait() == 0);
  }
  SUBCASE("a monitor that is not there is refused with those that are") {
    words.insert(words.end(), {"--monitor", "7"});
    Process window(words, screen.folder / "said");
    CHECK(window.wait() == 2);
    CHECK(window.output() ==
          "kerf-visualizer: --monitor: 7 is not there; take 1 (screen, 1280x960)\n");
  }
}

TEST_CASE("keys and mouse work the window") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder);
  const auto first = user.picture();
  CHECK(user.picture() == first);

  SUBCASE("v takes the next renderer") {
    act("key v");
    CHECK(user.picture() != first);
    CHECK(user.quit() == 0);
    CHECK(user.report()["renderer"] == "blend");
  }
  SUBCASE(
      "c cuts the volumes open, y changes colours, t shows two eyes; once more, and it is undone") {
    for (const std::string key : {"c", "y", "t"}) {
      CAPTURE(key);
      act("key " + key);
      CHECK(user.picture() != first);
      act("key " + key);
      CHECK(user.picture() == first);
    }
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag turns, r turns back, the wheel zooms") {
    act("mousedown 1 mousemove 360 200 sleep 0.2 mouseup 1");
    CHECK(user.picture() != first);
    act("key r");
    CHECK(user.picture() == first);
    act("click 4");
    CHECK(user.picture() != first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag with shift, or with the middle button, moves") {
    act("keydown shift mousedown 1 mousemove 340 200 sleep 0.2 mouseup 1 keyup shift");
    const auto shifted = user.picture();
    CHECK(shifted != first);
    act("key r mousemove 300 180");
    CHECK(user.picture() == first);
    act("mousedown 2 mousemove 340 200 sleep 0.2 mouseup 2");
    CHECK(user.picture() == shifted);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a digit asks the controller for that tool, where there is one") {
    act("key 2 key 9");
    CHECK(user.controller().asked_tools() == std::vector<std::uint64_t>{1});
    CHECK(user.quit() == 0);
  }
  SUBCASE("the list of tools asks for the one that is taken from it") {
    click("90 216");
    click("60 255");  // the second one
    CHECK(user.controller().asked_tools() == std::vector<std::uint64_t>{1});
    CHECK(user.quit() == 0);
  }
  SUBCASE("u undoes all cuts when it is pressed twice; z the last stroke, if there is one") {
    act("key u");
    CHECK(user.controller().resets() == 0);
    act("key u");
    CHECK(user.controller().resets() == 1);
    act("key z");
    CHECK(user.controller().undos() == 0);
    user.controller().offer_undo();
    user.controller().tick();
    static_cast<void>(user.picture());  // after a picture the window knows of it
    act("key z");
    CHECK(user.controller().undos() == 1);
    CHECK(user.quit() == 0);
  }
  SUBCASE("x cuts the volumes open square to the gaze, and the wheel with shift moves the plane") {
    act("key c");
    const auto along_z = user.picture();
    act("key x");
    const auto facing = user.picture();
    CHECK(facing != along_z);
    CHECK(facing != first);
    act("keydown shift click 5 click 5 click 5 click 5 keyup shift");
    const auto nearer = user.picture();
    CHECK(nearer != facing);
    act("keydown shift click 4 click 4 click 4 click 4 keyup shift");
    CHECK(user.picture() == facing);
    act("key c");
    CHECK(user.picture() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("l shows three slices through the tip, and hides them") {
    user.controller().tick();
    const auto before = right_edge(user.whole());
    act("key l");
    CHECK(right_edge(user.whole()) != before);
    act("key l");
    CHECK(right_edge(user.whole()) == before);
    CHECK(user.quit() == 0);
  }
  SUBCASE("e exports the surface") {
    act("key e");
    CHECK(user.quit() == 0);
    CHECK(fs::file_size(user.out() / "kerf-0001.ply") > 1000);
  }
  SUBCASE("h shows the keys on two pages, then no panel at all, then what was there") {
    const auto panels = user.whole().rgb;
    act("key h");
    const auto keys = user.whole().rgb;
    CHECK(keys != panels);
    act("key h");
    const auto more = user.whole().rgb;
    CHECK(more != keys);
    CHECK(more != panels);
    act("key h");
    const auto nothing = user.whole().rgb;
    CHECK(nothing != keys);
    CHECK(nothing != panels);
    act("key h");
    CHECK(user.whole().rgb != nothing);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag that begins on the controls does not turn") {
    act("mousemove 190 330 sleep 0.2 mousedown 1 sleep 0.2 mousemove 300 100 sleep 0.2 mouseup 1 "
        "mousemove 300 180");
    const auto after = user.picture();
    CHECK(user.quit() == 0);
    CHECK(after == first);
  }
  SUBCASE("a slider changes an opacity while it is dragged, and w writes it") {
    act("key v");
    const auto blended = user.picture();
    act("mousemove 131 284 sleep 0.2 mousedown 1 sleep 0.2 mousemove 60 284 sleep 0.2");
    CHECK(user.picture() != blended);
    act("mouseup 1 mousemove 300 180 key w");
    CHECK(user.quit() == 0);
    const Opacities written = read_transfer(user.out() / "kerf-0001.toml");
    REQUIRE(written.size() == 1);
    CHECK(written.at("bone") < 0.1);
  }
  SUBCASE("m films until m") {
    act("key m sleep 0.3 key m");
    CHECK(user.quit() == 0);
    if (have_ffmpeg()) {
      CHECK(test::text_of(user.out() / "kerf-0001.mp4").find("ftyp") == 4);
    } else {
      std::ifstream video(user.out() / "kerf-0001.y4m", std::ios::binary);
      std::string line;
      std::getline(video, line);
      CHECK(line.find("YUV4MPEG2 W480 H360 F60:1 ") == 0);
      std::getline(video, line);
      CHECK(line == "FRAME");
    }
  }
  SUBCASE("every panel may be shown") {
    act("key p key l key h sleep 0.2 key p key p key h key h key h");
    CHECK(user.picture() == first);
    CHECK(user.quit() == 0);
  }
  const std::string window = "search --name 'kerf: test' ";
  SUBCASE("a window of one pixel, or of nothing on a side, comes back whole") {
    for (const char* size : {"1 1", "0 0", "1 360", "480 1"}) act(window + "windowsize " + size);
    act(window + "windowsize 480 360");
    act("mousemove 300 180");
    CHECK(user.picture() == first);
    CHECK(user.look_at_screen() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a window of another size fills the screen with a picture of that size") {
    CHECK(user.look_at_screen() == first);
    for (const char* size : {"360 270", "600 450"}) {
      act(window + "windowsize " + size);
      const auto seen = user.picture();
      CHECK(seen.size() != first.size());
      CHECK(user.look_at_screen() == seen);
    }
    CHECK(user.quit() == 0);
  }
  SUBCASE("a window that is minimised and restored shows what it showed, and still follows keys") {
    for (int times = 0; times < 3; ++times) {
      act(window + "windowunmap");
      act(window + "windowmap");
    }
    act("mousemove 300 180");
    CHECK(user.picture() == first);
    act("key v");
    CHECK(user.picture() != first);
    CHECK(user.quit() == 0);
  }
}

TEST_CASE("o lists scenes; a file that is none is told, a scene ends the window with its name") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder);
  const std::string none = "60 78", one = "60 95";  // below the folder above
  // After a picture the window has done what it was asked.
  const auto done = [&user] { static_cast<void>(user.picture()); };
  act("key o");
  done();
  click(none);
  done();
  CHECK(user.choice().empty());
  act("key o");  // leaves the list and what it said
  done();
  act("key o");
  done();
  click(one);
  CHECK(user.ended() == 0);
  CHECK(user.choice() == (screen.folder / "scenes" / "one.toml").string());
}

TEST_CASE("nothing covers a warning, whatever else is shown and in a small window too") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder);
  constexpr int kMostOfIt = 5'000;  // of the ground of "stale: no news from the servo"
  CHECK(warning_pixels(user.whole()) > kMostOfIt);
  click("100 310");  // the controls, to the front
  CHECK(warning_pixels(user.whole()) > kMostOfIt);
  act("key h");
  CHECK(warning_pixels(user.whole()) > kMostOfIt);
  act("search --name 'kerf: test' windowsize 300 360");
  CHECK(warning_pixels(user.whole()) > kMostOfIt);
  CHECK(user.quit() == 0);
}

TEST_CASE("each of two volumes takes its own renderer, by keys and by its list") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder, 2);
  const auto first = user.picture();
  SUBCASE("b says which one v is for, and then that it is for all again") {
    act("key b key b key v");  // the second
    const auto mixed = user.picture();
    CHECK(mixed != first);
    act("key b key v key v key v key v key v key v");
    CHECK(user.picture() == first);
    act("key b key b key v");
    CHECK(user.picture() == mixed);
    CHECK(user.quit() == 0);
    CHECK(user.report()["renderer"] == "iso,blend");
  }
  SUBCASE("its list in the panel") {
    click("90 238");  // the second one's,
    click("45 145");  // and in it blend
    act("mousemove 300 180");
    CHECK(user.picture() != first);
    CHECK(user.quit() == 0);
    CHECK(user.report()["renderer"] == "iso,blend");
  }
}

TEST_CASE("the exit code of a window tells how the controller ended, and a video cut short") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder);
  SUBCASE("cleanly") {
    user.controller().say(Lifecycle::clean_end);
    CHECK(user.quit() == 0);
  }
  SUBCASE("by a fault") {
    user.controller().say(Lifecycle::fault);
    CHECK(user.quit() == 1);
  }
  SUBCASE("a window that changes its size ends the video") {
    user.begin_video();
    act("search --name 'kerf: test' windowsize 400 300");
    CHECK(user.whole().size == PictureSize{400, 300});  // it has drawn one of that size
    CHECK(user.quit() == 1);
  }
  SUBCASE("a video that the user ends is whole") {
    user.begin_video();
    act("key m");
    static_cast<void>(user.whole());  // the key was seen
    act("search --name 'kerf: test' windowsize 400 300");
    CHECK(user.whole().size == PictureSize{400, 300});
    CHECK(user.quit() == 0);
  }
}

TEST_CASE("whatever a user does in a window, nothing is written beside a block") {
  if (!have("Xvfb")) return;
  const Screen screen;
  const std::string out = (screen.folder / "out").string();
  for (const char* sizes : {"", "--large "}) {  // 800x600 and 1100x760
    CAPTURE(sizes);
    CHECK(std::system((KERF_TEST_BIN "/kerf-visualizer-monkey --window --seed 1 --events 15 " +
                       (sizes + ("--seconds 0 --out " + out)))
                          .c_str()) == 0);
  }
}

}  // namespace kerf::window_test
