// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/scene_view.hpp"

#include <cmath>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::scene_view_test {
namespace {

SegmentInfo segment_with(const std::string& json) {
  SegmentVolumeInfo volume;
  volume.grid = {10, 20, 30};
  volume.bricks = BrickGrid::of(volume.grid);
  volume.spacing_mm = {0.1, 0.2, 0.3};
  volume.origin_mm = {1, 2, 3};
  volume.orientation = {static_cast<float>(-std::sqrt(0.5)), 0, 0,
                        static_cast<float>(std::sqrt(0.5))};
  volume.iso = 30000;
  SegmentInfo info;
  info.volumes = {volume, volume};
  info.scene_json = json;
  return info;
}

const std::string kScene = R"({
  "volumes": [{"name": "lower", "solid": false}, {"name": "upper", "solid": true}],
  "tools": [{"name": "ball", "profile": [[-1, 0], [0, 1], [1, 0]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]}]})";

}  // namespace

TEST_CASE("a voxel stands where the descriptor's origin, turn and spacing put it") {
  const SceneView scene = scene_view(segment_with(kScene));
  // -90 degrees about x takes the volume's z to world y, and its y to world -z.
  const glm::dvec4 at = scene.volumes[0].world_from_voxel * glm::dvec4(1, 2, 3, 1);
  CHECK(at.x == doctest::Approx(1.1));
  CHECK(at.y == doctest::Approx(2.9));
  CHECK(at.z == doctest::Approx(2.6));
  CHECK(scene.main_volume().name == "upper");  // the first solid one
  CHECK(scene.tools[0].profile_mm[1] == std::array<double, 2>{0.0, 1.0});
}

TEST_CASE("a shaft that is felt comes with its outline, a wrong one in one line") {
  const auto shafted = [](const std::string& outline) {
    return scene_view(segment_with(
        R"({"volumes": [], "materials": [], "tools": [{"name": "ball",
            "profile": [[-1, 0], [0, 1], [1, 0]], "shaft": )" +
        outline + "}]}"));
  };
  const SceneView scene = shafted("[[0.8, 0.6], [5, 0.6], [5, 0]]");
  CHECK(scene.tools[0].shaft_mm.size() == 3);
  CHECK(scene.tools[0].radius_mm == 1.0);  // of the head
  CHECK(scene_view(segment_with(kScene)).tools[0].shaft_mm.empty());
  CHECK_THROWS_AS(static_cast<void>(shafted("[[0.8, -0.6], [5, 0.6]]")), VisualizerError);
}

TEST_CASE("a box has its corners half a voxel outside the outermost centres") {
  const SceneView scene = scene_view(segment_with(kScene));
  const BoxCorners corners = scene.volumes[0].corners();
  const glm::dvec3 diagonal = corners[7] - corners[0];
  CHECK(glm::length(diagonal) == doctest::Approx(std::sqrt(1.0 + 16.0 + 81.0)));
}

TEST_CASE("a tool that is a mesh comes with its points and triangles") {
  const SceneView scene = scene_view(segment_with(R"({
    "volumes": [], "materials": [], "tools": [{"name": "wedge", "mesh": {
      "points_mm": [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]],
      "triangles": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]}}]})"));
  CHECK(scene.tools[0].facets.points_mm.size() == 4);
  CHECK(scene.tools[0].facets.triangles[1] == std::array<std::uint32_t, 3>{0, 1, 3});
  CHECK(scene.tools[0].radius_mm == 3.0);
}

TEST_CASE("a scene text that is not ours is refused in one line, never a crash") {
  for (const char* text :
       {"", "{}", "[1]", "nonsense", R"({"volumes": 3, "tools": [], "materials": []})",
        R"({"volumes": [], "tools": [{"name": "t", "profile": [[0, -1]]}], "materials": []})",
        R"({"volumes": [], "tools": [{"name": "t", "profile": [[0]]}], "materials": []})",
        R"({"volumes": [], "tools": [{"name": "t", "mesh": {"points_mm": [[0, 0, 0]],
           "triangles": [[0, 0, 1]]}}], "materials": []})",
        R"({"volumes": [], "tools": [{"name": "t", "mesh": {"points_mm": [[0, 0, 1e999]],
           "triangles": [[0, 0, 0]]}}], "materials": []})",
        R"({"volumes": [], "tools": [{"name": "t", "mesh": {"points_mm": [],
           "triangles": []}}], "materials": []})"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(static_cast<void>(scene_view(segment_with(text))), VisualizerError);
  }
  CHECK(rc::check([] {
    std::string text = kScene;
    const auto hits = *rc::gen::container<std::vector<std::pair<std::size_t, char>>>(
        rc::gen::pair(rc::gen::inRange<std::size_t>(0, text.size()), rc::gen::arbitrary<char>()));
    for (const auto& [at, byte] : hits) text[at] = byte;
    try {
      static_cast<void>(scene_view(segment_with(text)));
    } catch (const VisualizerError& problem) {
      RC_ASSERT(std::string(problem.what()).find('\n') == std::string::npos);
    }
  }));
}

}  // namespace kerf::scene_view_test
