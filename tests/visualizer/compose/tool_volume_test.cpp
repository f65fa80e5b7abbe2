// SPDX-License-Identifier: Apache-2.0
// The tool as a volume: distances to its mesh, its voxels, and that it is one volume among others.
#include "visualizer/compose/tool_volume.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/render/order_scene.hpp"
#include "visualizer/compose/picture_layers.hpp"
#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::tool_volume_test {

using namespace kerf::test;

namespace {

constexpr double kRadiusMm = 1.3;
constexpr double kEdgeMm = 0.17;  // the shortest of the main volume

ToolView ball_tool() {
  ToolView tool{.name = "ball", .profile_mm = {}, .radius_mm = kRadiusMm};
  constexpr int kSteps = 64;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 3.14159265358979 * i / kSteps;
    tool.profile_mm.push_back({-kRadiusMm * std::cos(angle), kRadiusMm * std::sin(angle)});
  }
  return tool;
}
ToolView pin_tool() {
  return {.name = "pin", .profile_mm = {{-2.0, 0.0}, {-2.0, 0.5}, {1.0, 0.5}}, .radius_mm = 0.5};
}

/// Of what `ball_tool` looks like with its shank as thick throughout as `shank_mm`.
Distance ball_tool_distance(const glm::dmat4& tool_from_world, double shank_mm) {
  const auto cylinder = [](glm::dvec3 at, double radius_mm, double low_mm, double high_mm) {
    const glm::dvec2 out(std::hypot(at.x, at.z) - radius_mm,
                         std::max(low_mm - at.y, at.y - high_mm));
    return glm::length(glm::max(out, 0.0)) + std::min(std::max(out.x, out.y), 0.0);
  };
  return [=](glm::dvec3 world) {
    const glm::dvec3 at(tool_from_world * glm::dvec4(world, 1.0));
    return std::min({glm::length(at) - kRadiusMm,
                     cylinder(at, 0.42 * kRadiusMm, 0.0, 2.5 * kRadiusMm),
                     cylinder(at, shank_mm, 2.5 * kRadiusMm, 3.5 * kRadiusMm),
                     cylinder(at, 0.62 * kRadiusMm, 3.5 * kRadiusMm, 17.0 * kRadiusMm)});
  };
}

Hand held(glm::dvec3 tip_mm) {
  // A turn of 40 degrees about (1, 0, 1).
  const double half = 0.5 * 40.0 * 3.14159265358979 / 180.0;
  const double part = std::sin(half) / std::sqrt(2.0);
  return {.tip_mm = tip_mm, .orientation = {part, 0.0, part, std::cos(half)}};
}

}  // namespace

TEST_CASE("a tool of voxels is half dense on its surface, and fades over two voxels") {
  SceneView scene = TwoBodies(false).scene;
  scene.tools = {ball_tool(), pin_tool()};
  ToolVolume tool(scene);
  CHECK_FALSE(tool.take(0).empty());
  CHECK(tool.take(0).empty());
  const VolumeView view = tool.added_to(scene).volumes.back();
  const double edge_mm = view.world_from_voxel[0][0];
  CHECK(edge_mm == doctest::Approx(kEdgeMm));
  const VoxelGrid& grid = view.bricks.grid;
  double worst = 0.0;
  int ramp = 0;
  for_each_voxel(grid.box(), [&](int x, int y, int z) {
    const glm::dvec3 at(view.world_from_voxel * glm::dvec4(x, y, z, 1.0));
    if (at.y > 0.5 * kRadiusMm) return;  // without the neck
    const double fraction =
        std::clamp(0.5 - (glm::length(at) - kRadiusMm) / (2.0 * edge_mm), 0.0, 1.0);
    const double is = tool.content().density[grid.index(x, y, z)] / kDensityMax;
    worst = std::max(worst, std::abs(is - fraction));
    ramp += fraction > 0.0 && fraction < 1.0 ? 1 : 0;
  });
  CHECK(ramp > 1000);
  CHECK(worst < 0.01);
  const auto is_air = [&] {
    return std::ranges::all_of(tool.content().density, [](Density d) { return d == 0; });
  };
  CHECK_FALSE(tool.take(1).empty());
  CHECK_FALSE(is_air());
  CHECK_FALSE(tool.take(7).empty());  // the scene has none
  CHECK(is_air());
}

TEST_CASE("a tool that is a mesh has the voxels of the same body swept about its axis") {
  SceneView scene = TwoBodies(false).scene;
  ToolView meshed{.name = "mesh", .profile_mm = {}, .radius_mm = kRadiusMm};
  const Mesh ball = lathe(ball_tool().profile_mm);
  for (const Mesh::Vertex& vertex : ball.vertices) {
    meshed.facets.points_mm.push_back({vertex.position.x, vertex.position.y, vertex.position.z});
  }
  for (std::size_t i = 0; i < ball.triangles.size(); i += 3) {
    meshed.facets.triangles.push_back(
        {ball.triangles[i], ball.triangles[i + 1], ball.triangles[i + 2]});
  }
  scene.tools = {ball_tool(), meshed};
  ToolVolume tool(scene);
  tool.take(0);
  const auto swept = tool.content().density;
  const std::vector<Density> expected(swept.begin(), swept.end());
  tool.take(1);
  int worst = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    worst = std::max(worst, std::abs(tool.content().density[i] - expected[i]));
  }
  // The middle of one of 48 sides is 0.0028 mm inside of the circle.
  CHECK(worst < 0.0029 / (2 * kEdgeMm) * kDensityMax + 0.005 * kDensityMax);
}

TEST_CASE("a box around the tool holds all of its voxels that are not air") {
  SceneView scene = TwoBodies(false).scene;
  scene.tools = {ball_tool(), pin_tool()};
  ToolVolume tool(scene);
  const VolumeView view = tool.added_to(scene).volumes.back();
  const VoxelGrid& grid = view.bricks.grid;
  for (const std::uint32_t index : {0U, 1U}) {
    tool.take(index);
    const BoxCorners box = tool.corners({.tool = index}).value();
    const double edge_mm = view.world_from_voxel[0][0];
    double nearest_mm = 1e9;
    for_each_voxel(grid.box(), [&](int x, int y, int z) {
      if (tool.content().density[grid.index(x, y, z)] == 0) return;
      const glm::dvec3 at(view.world_from_voxel * glm::dvec4(x, y, z, 1.0));
      const glm::dvec3 inside = glm::min(at - box.front(), box.back() - at);
      nearest_mm = std::min({nearest_mm, inside.x, inside.y, inside.z});
    });
    CHECK(nearest_mm > 0.9 * edge_mm);  // what is interpolated from it is inside too
    CHECK(nearest_mm < 3.0 * edge_mm);
  }
  CHECK_FALSE(tool.corners({.tool = 2}));
}

TEST_CASE("beside a tool of voxels the other volumes look as they did") {
  const SceneView scene = [] {
    SceneView two = TwoBodies(false).scene;
    two.tools = {pin_tool()};
    return two;
  }();
  const SceneView with = ToolVolume(scene).added_to(scene);
  REQUIRE(with.volumes.size() == scene.volumes.size() + 1);
  const Palette before = make_palette(scene.materials), after = make_palette(with.materials);
  CHECK(before[0] == after[0]);
  for (std::size_t m = 0; m < scene.materials.size(); ++m) CHECK(before[1][m] == after[1][m]);
}

TEST_CASE("a scene without a tool, or with too many materials, has no tool of voxels") {
  SceneView scene = TwoBodies(false).scene;
  CHECK_THROWS_WITH_AS(ToolVolume{scene},
                       "--voxel-tool: the scene has no tool with an extent; leave the option out",
                       VisualizerError);
  scene.tools = {pin_tool()};
  scene.materials.resize(256);
  CHECK_THROWS_WITH_AS(ToolVolume{scene},
                       "--voxel-tool: the scene has 255 materials and the tool needs one more; "
                       "leave the option out",
                       VisualizerError);
}

TEST_CASE("a volume that is placed shows what one that was made there shows, in every renderer") {
  if (!have_gl()) return;
  constexpr PictureSize kSize{96, 96};
  const RenderTarget target(kSize);
  const TwoBodies two(false);
  const auto contents = two.contents();
  const View view = look_at({2, 3, 30}, {0.4, 0, 0.2}, 15, 45);
  const glm::dmat4 there =
      glm::translate(glm::dmat4(1.0), {0.7, -1.3, 2.1}) * two.scene.volumes[1].world_from_voxel;
  SceneView made = two.scene;
  made.volumes[1].world_from_voxel = there;
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    const auto placed = make_renderer(kind, two.scene, contents);
    const Drawn before = draw(*placed, view, target);
    placed->set_transform(1, there);
    const Drawn after = draw(*placed, view, target);
    const Drawn wanted = draw(*make_renderer(kind, made, contents), view, target);
    CHECK(after.rgb == wanted.rgb);
    CHECK(after.depth == wanted.depth);
    CHECK(after.depth != before.depth);
  }
}

TEST_CASE("of a tool of voxels and two volumes the nearest is seen, in every renderer") {
  if (!have_gl()) return;
  constexpr PictureSize kSize{128, 128};
  constexpr double kMarginMm = 2.0 * TwoBodies::kShortestMm;
  constexpr double kDepthMm = 0.5 * TwoBodies::kShortestMm;
  const RenderTarget target(kSize);
  TwoBodies two(false);
  two.scene.tools = {ball_tool()};
  two.scene.voxel_tool = true;
  const View view = look_at({2, 3, 30}, {0.4, 0, 0.2}, 15, 45);
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    ScenePainter painter(std::string(kind), two.scene, two.contents());
    const bool translucent = is_translucent(kind);
    REQUIRE(painter.hand_is_opaque_volume() != translucent);
    const double reach_mm = two.reach_mm(translucent);
    const double tool_reach_mm = reach_mm * 2.0 * kEdgeMm / TwoBodies::kRampMm;
    int shown = 0, covered = 0;
    for (const glm::dvec3 tip_mm :
         {glm::dvec3(0, 0, 4), glm::dvec3(1, 1, 1), glm::dvec3(0, -1, -3)}) {
      const Hand hand = held(tip_mm);
      target.bind();
      glClearColor(0.0F, 0.0F, 0.0F, 1.0F);
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      painter.hold({hand});
      for (const auto layer : {ScenePainter::Layer::opaque, ScenePainter::Layer::translucent}) {
        painter.draw_volumes(layer, view, target);
      }
      const Drawn drawn{target.read_rgb(), target.read_depth()};
      const glm::dmat4 tool_from_world = glm::inverse(rigid(hand.tip_mm, hand.orientation));
      const auto answer_for = [&](double shank_mm) {
        std::vector<Distance> bodies = two.bodies;
        bodies.push_back(ball_tool_distance(tool_from_world, shank_mm));
        return nearest_bodies(bodies, {reach_mm, reach_mm, tool_reach_mm}, view, kSize);
      };
      // The shank grows from the one to the other.
      const auto answer = answer_for(0.42 * kRadiusMm), thick = answer_for(0.62 * kRadiusMm);
      const auto clear = clear_pixels(answer, kSize, kMarginMm);
      int wrong_depth = 0, wrong_colour = 0;
      for (std::size_t at = 0; at < answer.size(); ++at) {
        const Nearest& nearest = answer[at];
        if (!clear[at] || nearest.body < 0 || nearest.mm != thick[at].mm) continue;
        const double off_mm = eye_distance_mm(double{drawn.depth[at]}, view) - nearest.mm;
        wrong_depth += std::abs(off_mm) > kDepthMm ? 1 : 0;
        (nearest.body == 2 ? shown : covered) += 1;
        if (translucent) continue;
        const std::uint8_t* const rgb = &drawn.rgb[3 * at];
        const bool grey = std::abs(rgb[0] - rgb[1]) < 30;
        wrong_colour += grey == (nearest.body == 2) ? 0 : 1;
      }
      CAPTURE(tip_mm.z);
      CHECK(wrong_depth == 0);
      CHECK(wrong_colour == 0);
    }
    CHECK(shown > 500);
    CHECK(covered > 2000);
  }
}

namespace {

constexpr glm::dvec3 kHalf{14.0, 0.7, 2.0};  // mm: long triangles, and some that are hardly wide

/// The box's corners as a mesh, each side in `strips` x 1 pairs of triangles.
Facets box_mesh(const glm::dmat4& world_from_box, int strips) {
  Facets mesh;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      const auto point = [&](double along, double across) {
        glm::dvec3 at{};
        at[axis] = side * kHalf[axis];
        at[u] = along * kHalf[u];
        at[v] = side * across * kHalf[v];
        const glm::dvec3 world(world_from_box * glm::dvec4(at, 1.0));
        mesh.points_mm.push_back({world.x, world.y, world.z});
        return static_cast<std::uint32_t>(mesh.points_mm.size() - 1);
      };
      for (int strip = 0; strip < strips; ++strip) {
        const double from = 2.0 * strip / strips - 1.0, to = 2.0 * (strip + 1) / strips - 1.0;
        const std::uint32_t a = point(from, -1), b = point(to, -1), c = point(to, 1),
                            d = point(from, 1);
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      }
    }
  }
  return mesh;
}

double box_distance(glm::dvec3 at) {
  const glm::dvec3 out = glm::abs(at) - kHalf;
  return glm::length(glm::max(out, 0.0)) + std::min(std::max({out.x, out.y, out.z}), 0.0);
}

}  // namespace

TEST_CASE(
    "distances to a slanting box of long triangles are its own, to the reach and no farther") {
  const glm::dmat4 world_from_box =
      glm::rotate(glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(0.3, -0.2, 0.1)), 0.7,
                              glm::normalize(glm::dvec3(1, 2, -1))),
                  0.5, glm::dvec3(0, 1, 0));
  const glm::dmat4 box_from_world = glm::inverse(world_from_box);
  const GridPoints points{{61, 47, 53}, glm::dvec3(-14.2, -11.0, -12.1), 0.47};
  for (const int strips : {1, 3, 40}) {
    for (const double reach_mm : {0.3, 0.9, 2.5}) {
      CAPTURE(strips);
      CAPTURE(reach_mm);
      const auto distances = facet_distances(box_mesh(world_from_box, strips), points, reach_mm);
      double worst = 0.0;
      int near = 0;
      int inside = 0;
      for_each_voxel(points.grid.box(), [&](int x, int y, int z) {
        const glm::dvec3 world = points.first_mm + points.edge_mm * glm::dvec3(x, y, z);
        const double exact = std::clamp(
            box_distance(glm::dvec3(box_from_world * glm::dvec4(world, 1.0))), -reach_mm, reach_mm);
        const auto own = static_cast<double>(distances[points.grid.index(x, y, z)]);
        worst = std::max(worst, std::abs(own - exact));
        near += std::abs(exact) < reach_mm ? 1 : 0;
        inside += exact < 0.0 ? 1 : 0;
      });
      CHECK(near > 500);
      CHECK(inside > 500);
      CHECK(worst < 1e-5);
    }
  }
}

}  // namespace kerf::tool_volume_test
