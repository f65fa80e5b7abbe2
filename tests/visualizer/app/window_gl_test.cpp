// SPDX-License-Identifier: Apache-2.0
// Windows and pictures where OpenGL is old, or comes another way.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/process.hpp"
#include "tests/visualizer/app/window_fixture.hpp"
#include "visualizer/picture/image_files.hpp"

using namespace kerf;
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
