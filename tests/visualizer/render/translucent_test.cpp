// SPDX-License-Identifier: Apache-2.0
// What the eye sees inside volumes, against what follows from the transfer function; slices of a
// box.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>
#include <rapidcheck.h>

#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/render/translucent_renderers.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::translucent_test {

using namespace kerf::test;

namespace {

constexpr double kBlockMm = 4.0;

/// A cube of 4 mm about the origin, full density up to its border.
TestVolume solid_block(double spacing_mm) {
  const int n = static_cast<int>(std::lround(kBlockMm / spacing_mm));
  const VoxelGrid grid{n, n, n};
  return {grid, centred(grid, glm::dvec3(spacing_mm)), [](glm::dvec3) { return 1.0; }};
}

/// What a `solid_block` leaves of a light on the z axis at `light_mm`, seen from +z, by the
/// transfer function: (1 - a)^(length / kOpacityMm), the fading border with its exact integral.
double transparency(const TestVolume& block, double light_mm,
                    std::span<const MaterialView> materials = {}) {
  const double edge_mm = block.view.world_from_voxel[0][0];
  const TransferFunction transfer =
      make_transfer_function(materials, block.view.iso, false, 0, edge_mm);
  const double opacity = static_cast<double>(transfer.materials[0][255].a);
  // From the centre of the last voxels the density falls to zero over one edge.
  const double last_centre_mm = 0.5 * (kBlockMm - edge_mm);
  const double border_edges = 1.0 - 0.5 * (transfer.empty + transfer.full);
  const double length_mm = last_centre_mm - light_mm + border_edges * edge_mm;
  return std::pow(1.0 - opacity, length_mm / kOpacityMm);
}

/// The fraction of the light behind that a picture shows: from 98 % on, opacity counts as all.
double shown(double transparency) {
  return 1.0 - std::min((1.0 - transparency) / 0.98, 1.0);
}

/// The fraction of a white wall that is seen in the middle of the picture, `wall_mm` from the eye.
double seen_through(Renderer& renderer, const View& view, double wall_mm) {
  const RenderTarget target(kTestSize);
  const auto before_wall = [&](float brightness) {
    target.bind();
    glClearColor(brightness, brightness, brightness, 1.0F);
    glClearDepth(window_depth(wall_mm, view.near_mm, view.far_mm));
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glClearDepth(1.0);
    renderer.draw(view, target);
    return target.read_rgb()[3 * kMiddle];
  };
  return (before_wall(1.0F) - before_wall(0.0F)) / 255.0;
}

const View kBlockView = look_at({0, 0, 30}, {}, 10, 50);

}  // namespace

TEST_CASE("the picture converges with the step, and the default step is near the end") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const RenderTarget target(kTestSize);
  const auto picture = [&](float step_vox) {
    SceneView scene = scene_of({&volume});
    // Over its voxels as opaque as the softest material is over those of the default scene.
    const double edges = volume.view.edges_mm().x / kOpacityMm;
    scene.materials = {{.name = "none"}, {.name = "soft"}};
    scene.materials[1].opacity = 1.0 - std::pow(0.6, 1.0 / edges);
    BlendRenderer renderer(scene, {&content, 1}, {.step_vox = step_vox});
    return draw(renderer, look_at({14, 9, 20}, {}, 10, 40), target);
  };
  const Drawn exact = picture(1.0F / 16.0F);
  const Difference coarse = difference(picture(2.0F), exact);
  const Difference one = difference(picture(1.0F), exact);
  const Difference fine = difference(picture(0.5F), exact);
  CHECK(one.mean < 0.6 * coarse.mean);  // at least first order
  CHECK(fine.mean < 0.6 * one.mean);
  CHECK(difference(picture(BlendRenderer::Options{}.step_vox), exact).mean < 1.5);
  CHECK(fine.most <= 14);  // the ramp of voxels of 0.2 mm is shorter than that of the default scene
}

TEST_CASE("an opaque thing inside is dimmed by what lies before it, and by nothing behind") {
  if (!have_gl()) return;
  const TestVolume block = solid_block(0.25);
  const VolumeContent content = block.content();
  for (const char* kind : {"blend", "slices"}) {
    const auto renderer = make_renderer(kind, scene_of({&block}), {&content, 1});
    for (const double wall_mm : {1.7, 1.4, 1.13, 0.9}) {
      CAPTURE(wall_mm);
      CHECK(seen_through(*renderer, kBlockView, 30.0 - wall_mm) ==
            doctest::Approx(shown(transparency(block, wall_mm))).epsilon(0.03));
    }
    CHECK(seen_through(*renderer, kBlockView, 20.0) == 1.0);  // before the block
    CHECK(seen_through(*renderer, kBlockView, 45.0) == 0.0);  // behind all of it
  }
}

TEST_CASE("where two volumes intersect both dim, whatever their order and voxel size") {
  if (!have_gl()) return;
  const TestVolume fine = solid_block(0.25), coarse = solid_block(0.5);
  const std::vector<MaterialView> faint{{.name = "none"}, {.name = "faint", .opacity = 0.05}};
  const double expected = shown(transparency(fine, 0.0, faint) * transparency(coarse, 0.0, faint));
  CHECK(expected > 0.1);
  for (const bool swapped : {false, true}) {
    const TestVolume& first = swapped ? coarse : fine;
    const TestVolume& second = swapped ? fine : coarse;
    const std::array<VolumeContent, 2> contents{first.content(), second.content()};
    SceneView scene = scene_of({&first, &second});
    scene.materials = faint;
    BlendRenderer renderer(scene, contents);
    CHECK(seen_through(renderer, kBlockView, 30.0) == doctest::Approx(expected).epsilon(0.03));
  }
}

TEST_CASE("labels give colour and opacity, also to the border that fades into the air") {
  if (!have_gl()) return;
  const VoxelGrid grid{32, 32, 32};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.0, 0.5));
  std::vector<Label> labels(grid.voxel_count(), 0);
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = volume.density[i] > 30000 ? 2 : 0;
  SceneView scene = scene_of({&volume});
  scene.materials = {{"none", 0.0, {0, 0, 0}}, {"red", 0.3, {1, 0, 0}}, {"green", 0.6, {0, 1, 0}}};
  const VolumeContent content{volume.density, labels};
  BlendRenderer renderer(scene, {&content, 1});
  const Drawn drawn = draw(renderer, look_at({0, 0, 30}, {}, 20, 40), RenderTarget(kTestSize));
  int green = 0;
  for (std::size_t i = 0; i < drawn.depth.size(); ++i) {
    if (drawn.depth[i] >= 1.0F) continue;
    green += drawn.rgb[3 * i + 1] > 0 ? 1 : 0;
    CHECK(drawn.rgb[3 * i] <= drawn.rgb[3 * i + 1]);  // red is nowhere
  }
  CHECK(green > 1000);
}

TEST_CASE("what has no label shows the material of its density after a cut too") {
  if (!have_gl()) return;
  const VoxelGrid grid{32, 32, 32};
  TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.0, 0.5));
  std::vector<Label> labels(grid.voxel_count(), 0);
  labels.front() = 1;  // far from the ball
  SceneView scene = scene_of({&volume});
  scene.materials = {{"none", 0.0, {0, 0, 0}}, {"red", 0.3, {1, 0, 0}}, {"green", 0.9, {0, 1, 0}}};
  const VolumeContent content{volume.density, labels};
  BlendRenderer edited(scene, {&content, 1});
  for (Density& density : volume.density) density = static_cast<Density>(density / 2);
  edited.update(0, volume.density, changed_in(volume.view.bricks, grid.box()));
  BlendRenderer fresh(scene, {&content, 1});
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const RenderTarget target(kTestSize);
  const Drawn seen = draw(edited, view, target);
  CHECK(*std::max_element(seen.rgb.begin(), seen.rgb.end()) > 0);
  const bool same = seen.rgb == draw(fresh, view, target).rgb;
  CHECK(same);
}

TEST_CASE("more volumes than texture units are refused, and the limit is named") {
  if (!have_gl()) return;
  GLint units = 0;
  glGetIntegerv(GL_MAX_TEXTURE_IMAGE_UNITS, &units);
  const auto limit = static_cast<std::size_t>(units - 3) / 3;
  const VoxelGrid grid{2, 2, 2};
  const TestVolume volume(grid, glm::dmat4(1.0), [](glm::dvec3) { return 1.0; });
  SceneView scene;
  scene.volumes.assign(limit + 1, volume.view);
  const std::vector<VolumeContent> contents(limit + 1, volume.content());
  CHECK_THROWS_WITH_AS(BlendRenderer(scene, contents),
                       ("renderer: " + std::to_string(limit + 1) +
                        " volumes, and this OpenGL driver has texture units for " +
                        std::to_string(limit) + " translucent ones; take --renderer iso")
                           .c_str(),
                       VisualizerError);
}

namespace {

BoxCorners rotated_bounds(double angle, glm::dvec3 axis, glm::dvec3 half_mm, double eye_mm) {
  const glm::dmat4 pose = glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, -eye_mm)),
                                      angle, glm::normalize(axis));
  BoxCorners corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec3 at((i & 1) != 0 ? half_mm.x : -half_mm.x,
                        (i & 2) != 0 ? half_mm.y : -half_mm.y,
                        (i & 4) != 0 ? half_mm.z : -half_mm.z);
    corners[i] = glm::dvec3(pose * glm::dvec4(at, 1.0));
  }
  return corners;
}

double area(const std::vector<glm::dvec2>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 a = polygon[i];
    const glm::dvec2 b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return 0.5 * twice;
}

}  // namespace

TEST_CASE("a box that faces the eye is cut in its rectangle, and not at all before and behind") {
  const BoxCorners box = rotated_bounds(0.0, {0, 0, 1}, {2, 3, 4}, 20.0);
  CHECK(cut_box(box, 20.0).size() == 4);
  CHECK(area(cut_box(box, 20.0)) == doctest::Approx(24.0));
  CHECK(cut_box(box, 15.9).empty());
  CHECK(cut_box(box, 24.1).empty());
}

TEST_CASE("a cube cut across its diagonal gives a hexagon") {
  const BoxCorners cube =
      rotated_bounds(std::acos(1.0 / std::sqrt(3.0)), {1, -1, 0}, {1, 1, 1}, 10.0);
  const auto hexagon = cut_box(cube, 10.0);
  CHECK(hexagon.size() == 6);
  CHECK(area(hexagon) == doctest::Approx(3.0 * std::sqrt(3.0)));  // edge sqrt(2)
}

TEST_CASE("the areas of all cuts add up to the volume of the box") {
  CHECK(rc::check([] {
    const auto number = rc::gen::inRange(1, 200);
    const glm::dvec3 half(*number * 0.02, *number * 0.02, *number * 0.02);
    const BoxCorners box = rotated_bounds(*number * 0.03, {*number, *number, *number}, half, 30.0);
    constexpr double kStep = 0.01;
    double sum = 0.0;
    for (double eye_mm = 20.0; eye_mm < 40.0; eye_mm += kStep) {
      sum += area(cut_box(box, eye_mm)) * kStep;
    }
    const double volume = 8.0 * half.x * half.y * half.z;
    RC_ASSERT(std::abs(sum - volume) < 0.02 * volume + 0.05);
  }));
}

}  // namespace kerf::translucent_test
