// SPDX-License-Identifier: Apache-2.0
// A window while nothing happens, and when what it stands on goes away.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "tests/json.hpp"
#include "tests/support/process.hpp"
#include "tests/visualizer/app/window_fixture.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::window_end_test {

using namespace kerf::test;
namespace fs = std::filesystem;

TEST_CASE("before a hand that is still most frames of a window draw nothing") {
  if (!have("Xvfb")) return;
  const Screen screen;
  Controller controller;
  VisualizerOptions options;
  options.name = "test";
  options.mute = true;
  options.size = {160, 120};
  options.seconds = 2.0;
  options.report = screen.folder / "report.json";
  // A busy machine may have no time for frames; what is drawn each half second, the rates, is most
  // of few.
  constexpr int kEnough = 60, kTries = 30;
  int drawn = 0, rested = 0;
  for (int tries = 0; tries < kTries && drawn + rested < kEnough; ++tries) {
    fs::remove(*options.report);
    auto code = std::async(std::launch::async, [&] { return run_window(options); });
    while (code.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
      controller.tick();
    }
    CHECK(code.get() == 0);
    const auto report = kerf::test::read_json_file(*options.report);
    drawn = report["frames"].get<int>();
    rested = report["rest_frames"].get<int>();
    CHECK(drawn > 0);
  }
  if (drawn + rested < kEnough) {
    MESSAGE("skipped: this machine is too busy for " << kEnough << " frames in 2 s");
    return;
  }
  CHECK(rested > drawn);
}

TEST_CASE("a GL error in a window fails the test that makes it" * doctest::should_fail()) {
  if (!have("Xvfb")) FAIL("no screen: nothing to see, and this test has to fail");
  const Screen screen;
  const Window window({.size = PictureSize{64, 64}}, Window::Visibility::hidden);
  glEnable(GL_INVALID_ENUM);
}

TEST_CASE("a window whose GL context is lost ends with one line") {
  if (!have("Xvfb")) return;
  const Screen screen;
  const Controller controller;
  VisualizerOptions options;
  options.name = "test";
  options.mute = true;
  options.seconds = 100.0;
  // No test can reset a graphics card: the driver's answer is put in its place.
  const auto driver = glGetGraphicsResetStatus;
  glGetGraphicsResetStatus = []() -> GLenum { return GL_INNOCENT_CONTEXT_RESET; };
  CHECK_THROWS_WITH_AS(static_cast<void>(run_window(options)),
                       "OpenGL: the graphics card was reset by another program and its memory is "
                       "lost; start kerf-visualizer again",
                       VisualizerError);
  glGetGraphicsResetStatus = driver;
}

TEST_CASE("when the X server dies the window ends with one line, and the controller goes on") {
  if (!have("Xvfb") || !have("xdotool")) return;
  for (const int signal : {SIGTERM, SIGKILL, -SIGKILL}) {  // below 0: without GLX
    CAPTURE(signal);
    Screen screen("1280x960", signal > 0);
    Controller controller;
    Process window({KERF_TEST_BIN "/kerf-visualizer", "--name", "test", "--mute"},
                   screen.folder / "said");
    act("search --sync --onlyvisible --name 'kerf: test'");
    screen.end(std::abs(signal));
    CHECK(window.wait() == 2);
    CHECK(window.output() ==
          "kerf-visualizer: window: the X server is gone; the controller goes on, so start "
          "kerf-visualizer again on another screen or with --headless --out DIR\n");
    controller.tick();
    VisualizerOptions options;
    options.name = "test";
    options.headless = true;
    options.frames = 1;
    options.seconds = 0.5;
    options.size = {64, 48};
    options.out = screen.folder / "later";
    CHECK(run_headless(options) == 0);
    CHECK(fs::exists(options.out / "frame-0001.png"));
  }
}

TEST_CASE("a window says two minutes and ten seconds before its run ends that it will") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  Controller controller;
  controller.take_in_hand();
  controller.tick();
  Process window(
      {KERF_TEST_BIN "/kerf-visualizer", "--name", "test", "--mute", "--ends-after", "131"},
      screen.folder / "said");
  act("search --sync --onlyvisible --name 'kerf: test'");
  CHECK(window.output().find("this run ends") == std::string::npos);
  constexpr int kTicksPerS = 1000;
  int now_s = 0;
  for (const int left_s : {120, 10}) {
    for (; now_s < 131 - left_s; ++now_s) {
      for (int i = 0; i < kTicksPerS; ++i) controller.tick();
    }
    const std::string words = "this run ends in " + std::to_string(left_s) +
                              " s: it was given 131 s, by --seconds or by default; give --seconds "
                              "N for more\n";
    CHECK(eventually([&] { return window.output().find(words) != std::string::npos; },
                     std::chrono::seconds(30)));
  }
}

}  // namespace kerf::window_end_test
