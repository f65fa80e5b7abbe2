// SPDX-License-Identifier: Apache-2.0
// Windows and pictures where OpenGL is old, or comes another way.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/process.hpp"
#include "tests/visualizer/app/window_fixture.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/picture/image_files.hpp"

namespace kerf::window_gl_test {

using namespace kerf::test;
namespace fs = std::filesystem;

namespace {

/// kerf-visualizer, under a driver that says it has this version; Mesa's drivers take the word.
std::vector<std::string> visualizer(const std::string& version) {
  std::vector<std::string> words{"/usr/bin/env"};
  if (!version.empty()) words.push_back("MESA_GL_VERSION_OVERRIDE=" + version);
  words.insert(words.end(), {KERF_TEST_BIN "/kerf-visualizer", "--name", "test", "--mute"});
  return words;
}

}  // namespace

TEST_CASE("a screen without GLX, or whose OpenGL is 3.3, shows a window") {
  if (!have("Xvfb") || !have("xdotool")) return;
  for (const bool has_glx : {true, false}) {
    for (const std::string version : {"", "3.3"}) {
      CAPTURE(has_glx);
      CAPTURE(version);
      const Screen screen("1280x960", has_glx);
      const Controller controller;
      std::vector<std::string> words = visualizer(version);
      words.insert(words.end(), {"--size", "480x360", "--out", screen.folder.string()});
      Process window(words, screen.folder / "said");
      CHECK(seen_size() == PictureSize{480, 360});
      act("mousemove 300 180 key s");
      CHECK(eventually([&] { return fs::exists(screen.folder / "kerf-0001.png"); },
                       std::chrono::seconds(20)));
      act("key q");
      CHECK(window.wait() == 0);
    }
  }
}

namespace {

void fill(const RenderTarget& target, const PixelRect& part, float red) {
  const float colour[4] = {red, 0.4F, 0.2F, 1.0F};
  glEnable(GL_SCISSOR_TEST);
  glScissor(part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0);
  glClearNamedFramebufferfv(target.framebuffer(), GL_COLOR, 0, colour);
  glDisable(GL_SCISSOR_TEST);
}

}  // namespace

TEST_CASE("a window shows the parts of its picture that changed, and copies no other by llvmpipe") {
  if (!have("Xvfb")) return;
  constexpr PictureSize kSize{320, 200};
  for (const bool has_glx : {true, false}) {
    CAPTURE(has_glx);
    const Screen screen("640x480", has_glx);
    Window window({.size = kSize}, Window::Visibility::shown);
    const RenderTarget target(kSize);
    const auto show = [&](const std::vector<PixelRect>& parts) {
      static_cast<void>(window.poll());
      window.present(target, parts);
      glFinish();
    };
    const auto is_shown = [&] { return read_screen(kSize).rgb == target.read_rgb(); };
    fill(target, target.all(), 1.0F);
    // Until the screen has the window.
    CHECK(eventually(
        [&] {
          show({target.all()});
          return is_shown();
        },
        std::chrono::seconds(20)));
    // Two far apart, two that touch, one beyond the border.
    const std::vector<PixelRect> parts{{3, 5, 20, 17},
                                       {250, 150, 310, 199},
                                       {100, 80, 120, 90},
                                       {120, 80, 140, 95},
                                       {300, -5, 400, 12}};
    for (const float red : {0.0F, 0.5F}) {
      for (const PixelRect& part : parts) fill(target, part.clipped(target.all()), red);
      show(parts);
      CHECK(eventually(is_shown, std::chrono::seconds(20)));
    }
    const std::vector<std::uint8_t> before = target.read_rgb();
    fill(target, target.all(), 0.25F);
    show({{40, 40, 41, 41}});
    if (has_glx && query_gl_driver().software) {
      std::vector<std::uint8_t> seen = before;
      const auto pixel =
          static_cast<std::ptrdiff_t>(3 * ((kSize.height - 1 - 40) * kSize.width + 40));
      const std::vector<std::uint8_t> now = target.read_rgb();
      std::copy_n(now.begin() + pixel, 3, seen.begin() + pixel);
      CHECK(eventually([&] { return read_screen(kSize).rgb == seen; }, std::chrono::seconds(20)));
    }
    show({target.all()});
    CHECK(eventually(is_shown, std::chrono::seconds(20)));
    // The screen gives it another size, which it has not polled yet.
    for (int i = 0; i < 20; ++i) {
      window.resize(i % 2 == 0 ? PictureSize{200, 60} : kSize);
      window.present(target, i % 3 == 0 ? std::vector{target.all()} : parts);
    }
    window.resize(kSize);
    CHECK(eventually(
        [&] {
          show({target.all()});
          return is_shown();
        },
        std::chrono::seconds(20)));
  }
}

TEST_CASE("every renderer draws with OpenGL 3.3 what it draws with 4.5") {
  const fs::path folder = fs::temp_directory_path() / ("kerf-old-gl-" + std::to_string(::getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder);
  setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
  {
    Controller controller;
    controller.tick();
    std::vector<RgbPicture> sheets;
    for (const std::string version : {"", "3.3"}) {
      std::vector<std::string> words = visualizer(version);
      const fs::path sheet = folder / ("sheet" + version + ".png");
      words.insert(words.end(),
                   {"--headless", "--frames", "1", "--seconds", "0.2", "--size", "320x240",
                    "--sheet", sheet.string(), "--out", (folder / "out").string()});
      Process run(words, folder / "said");
      CHECK(run.wait() == 0);
      INFO(run.output());
      const auto drawn = read_png(sheet);
      REQUIRE(drawn);
      sheets.push_back(*drawn);
    }
    CHECK(sheets[0].rgb == sheets[1].rgb);
  }
  fs::remove_all(folder);
}

TEST_CASE("a driver that is too old is named with its version, and the page is offered") {
  if (!have("Xvfb")) return;
  const Screen screen;
  const Controller controller;
  for (const bool headless : {false, true}) {
    std::vector<std::string> words = visualizer("2.1");
    if (headless) words.emplace_back("--headless");
    Process window(words, screen.folder / "said");
    CHECK(window.wait() == 2);
    const std::string said = window.output();
    CAPTURE(said);
    CHECK(said.find("the driver has OpenGL 2.1") != std::string::npos);
    CHECK(said.find("4.5 is needed, or 3.3 with") != std::string::npos);
    CHECK(said.find("./kerf demo --serve") != std::string::npos);
    CHECK(said.find('\n') == said.size() - 1);
  }
}

}  // namespace kerf::window_gl_test
