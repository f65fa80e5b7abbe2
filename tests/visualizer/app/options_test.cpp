// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/options.hpp"

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::options_test {
namespace {

std::optional<VisualizerOptions> parse(std::initializer_list<const char*> arguments) {
  std::vector<const char*> argv{"kerf-visualizer"};
  argv.insert(argv.end(), arguments);
  return parse_options(static_cast<int>(argv.size()), argv.data());
}

}  // namespace

TEST_CASE("the command line of the demo is understood") {
  const auto options =
      parse({"--name", "demo", "--headless", "--frames", "12", "--every-ticks", "800", "--out", "o",
             "--size", "640x480", "--report", "r.json", "--cpu", "0,1", "--export", "m.ply"});
  REQUIRE(options);
  CHECK(options->name == "demo");
  CHECK(options->headless);
  CHECK(options->frames == 12);
  CHECK(options->every_ticks == 800);
  CHECK(options->size == PictureSize{640, 480});
  CHECK(options->report == "r.json");
  CHECK(options->mesh == "m.ply");
  CHECK(options->cpus == std::vector<int>{0, 1});
}

TEST_CASE("full screen and a monitor are a window's") {
  const auto options = parse({"--full-screen", "--monitor", "2"});
  REQUIRE(options);
  CHECK(options->full_screen);
  CHECK(options->monitor == 2);
  CHECK_FALSE(parse({})->full_screen);
  CHECK_FALSE(parse({})->size_is_given);
  CHECK(parse({"--size", "640x480"})->size_is_given);
  CHECK_THROWS_WITH_AS(parse({"--full-screen", "--headless"}),
                       doctest::Contains("--full-screen: --headless has no window; "),
                       VisualizerError);
  CHECK_THROWS_WITH_AS(parse({"--monitor", "2", "--bench"}),
                       doctest::Contains("--monitor: --bench has no window; "), VisualizerError);
}

TEST_CASE("a size that is none is refused with the limits") {
  for (const char* text : {"", "x", "640", "640x", "x480", "0x10", "640x480x2", "-1x5", "8193x1",
                           "64 x64", "99999999999x1"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(parse({"--size", text}), VisualizerError);
  }
  CHECK(parse_size("1x8192") == PictureSize{1, 8192});
  CHECK(rc::check([](const std::string& text) {
    try {
      const PictureSize size = parse_size(text);
      RC_ASSERT(text == std::to_string(size.width) + "x" + std::to_string(size.height));
    } catch (const VisualizerError&) {
    }
  }));
}

TEST_CASE("the gradient and a tool of voxels are part of the first look") {
  CHECK(parse({})->settings.gradient == GradientFilter::adaptive);
  CHECK_FALSE(parse({})->settings.voxel_tool);
  const ViewSettings settings = parse({"--gradient", "farid5", "--voxel-tool"})->settings;
  CHECK(settings.gradient == GradientFilter::farid5);
  CHECK(settings.voxel_tool);
}

TEST_CASE("camera and panels are part of the first look") {
  CHECK_FALSE(parse({})->settings.camera);
  CHECK(parse({})->panels);
  CHECK_FALSE(parse({"--panels", "off"})->panels);
  CHECK_THROWS_AS(parse({"--panels", "none"}), VisualizerError);
  const auto options = parse({"--camera", "-1,2,3,-4,5,6,0,1,0"});
  CHECK(options->settings.camera == CameraPose{{-1, 2, 3}, {-4, 5, 6}, {0, 1, 0}});
  CHECK_FALSE(options->camera_file);
  CHECK_THROWS_WITH_AS(parse({"--camera", "nowhere"}),
                       doctest::Contains("nowhere: no such file; name a camera"), VisualizerError);
}

TEST_CASE("each volume may have a renderer of its own, and one kind of them looks into volumes") {
  CHECK(parse({"--renderer", "surface,blend"})->settings.renderer == "surface,blend");
  CHECK_THROWS_WITH_AS(parse({"--renderer", "surface,"}),
                       doctest::Contains("--renderer:  is unknown; known: iso"), VisualizerError);
  CHECK_THROWS_WITH_AS(parse({"--renderer", "blend,iso,slices"}),
                       "--renderer: blend,iso,slices: blend and slices do not mix where volumes "
                       "intersect; take one of them for both",
                       VisualizerError);
  using Kinds = std::vector<std::string>;
  CHECK(renderer_of_each("cast", 3) == Kinds{"cast", "cast", "cast"});
  CHECK(renderer_of_each("cast,blend", 2) == Kinds{"cast", "blend"});
  CHECK_THROWS_WITH_AS(static_cast<void>(renderer_of_each("cast,blend", 1)),
                       "--renderer: cast,blend is for 2 volumes, and the scene has 1; name one for "
                       "all or one for each",
                       VisualizerError);
}

TEST_CASE("a choice for one volume leaves the others, but what is looked into has one renderer") {
  CHECK(with_renderer("iso", 2, 1, "blend") == "iso,blend");
  CHECK(with_renderer("iso,blend", 2, 0, "blend") == "blend");
  CHECK(with_renderer("blend,cast,blend", 3, 0, "slices") == "slices,cast,slices");
  CHECK(with_renderer("blend", 1, 0, "cast") == "cast");
  CHECK(next_renderer("iso,blend") == "blend");
  CHECK(next_renderer("cast-blend") == "iso");
  CHECK(next_renderer("iso", 2, 1) == "iso,blend");
  CHECK(next_renderer("surface,blend", 2, 1) == "surface");
}

TEST_CASE("every mistake on the command line is one line") {
  for (const auto& [option, value] :
       std::initializer_list<std::pair<const char*, const char*>>{{"--frames", "0"},
                                                                  {"--frames", "many"},
                                                                  {"--frames", "2.5"},
                                                                  {"--wait", "-1"},
                                                                  {"--nonsense", "1"},
                                                                  {"--cpu", "a"},
                                                                  {"--every-ticks", "0"},
                                                                  {"--mute", "stray"},
                                                                  {"--eyes", "wide"},
                                                                  {"--fps", "0"},
                                                                  {"--fps", "241"},
                                                                  {"--mute", "--stereo=7"},
                                                                  {"--mute", "--headless=no"},
                                                                  {"--transfer", "/tmp"},
                                                                  {"--mute", "--record"},
                                                                  {"--transfer", "/nowhere/t.toml"},
                                                                  {"--transfer", "/dev/null"},
                                                                  {"--convergence", "0"},
                                                                  {"--convergence", "nan"},
                                                                  {"--seconds", "nan"},
                                                                  {"--mute", "--seconds"}}) {
    CAPTURE(option);
    CAPTURE(value);
    try {
      static_cast<void>(parse({option, value}));
      FAIL("accepted");
    } catch (const VisualizerError& problem) {
      CHECK(std::string(problem.what()).find('\n') == std::string::npos);
    }
  }
}

TEST_CASE("beside a video there are pictures only where they are asked for") {
  CHECK(parse({"--headless"})->frames == 10);
  CHECK(parse({"--headless", "--record", "-"})->frames == 0);
  CHECK(parse({"--headless", "--record", "v.y4m", "--frames", "3"})->frames == 3);
}

TEST_CASE("the bench draws as large as the paper unless told otherwise, and alone writes a page") {
  CHECK(parse({"--bench"})->size == PictureSize{512, 512});
  CHECK(parse({"--bench", "--page", "p.md"})->page == "p.md");
  CHECK(parse({"--bench", "--size", "64x48"})->size == PictureSize{64, 48});
  CHECK_THROWS_WITH_AS(parse({"--page", "p.md"}), doctest::Contains("--bench"), VisualizerError);
}

TEST_CASE("a folder in the place of a file of opacities is called a folder") {
  CHECK_THROWS_WITH_AS(parse({"--transfer", "/tmp"}), "/tmp: is a folder; name a file in it",
                       VisualizerError);
}

}  // namespace kerf::options_test
