// SPDX-License-Identifier: Apache-2.0
// What the eye sees inside volumes, against what follows from the transfer function.
#include <algorithm>
#include <array>
#include <cmath>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/render/translucent_renderers.hpp"
#include "visualizer/scene/visualizer_error.hpp"

using namespace kerf;
using namespace kerf::test;

TEST_CASE("the picture converges with the step, and the default step is near the end") {
  if (!have_gl()) return;
  const TestVolume volume = heap_of_balls();
  const VolumeContent content = volume.content();
  const SceneView scene = scene_of({&volume});
  const RenderTarget target(kTestSize);
  const View view = look_at({14, 9, 20}, {}, 10, 40);
  const auto picture = [&](float step_vox) {
    BlendRenderer renderer(scene, {&content, 1}, {.step_vox = step_vox});
    return draw(renderer, view, target);
  };
  const Drawn exact = picture(1.0F / 16.0F);
  const Difference coarse = difference(picture(2.0F), exact);
  const Difference one = difference(picture(1.0F), exact);
  const Difference fine = difference(picture(0.5F), exact);
  CHECK(one.mean < 0.6 * coarse.mean);  // at least first order
  CHECK(fine.mean < 0.6 * one.mean);
  CHECK(difference(picture(BlendRenderer::Options{}.step_vox), exact).mean < 1.5);
  CHECK(fine.most <= 12);
}

TEST_CASE("the depth of a ball is where its material begins, to 0.15 voxel") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  constexpr double kRamp = 1.0;
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 3.5, kRamp));
  const VolumeContent content = volume.content();
  BlendRenderer renderer(scene_of({&volume}), {&content, 1});
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
  const double empty = make_transfer_function({}, volume.view.iso, false).empty;
  const double radius_mm = 3.5 + kRamp * (0.5 - empty);
  double worst_mm = 0.0;
  int hits = 0;
  for (int y = 0; y < kTestSize.height; ++y) {
    for (int x = 0; x < kTestSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kTestSize, x, y);
      const glm::dvec3 toward = glm::normalize(ray.direction);
      const double miss_mm = glm::length(glm::cross(ray.origin_mm, toward));
      if (miss_mm > 0.85 * radius_mm) continue;  // no slope at the rim
      const float depth = drawn.depth[pixel_at(x, y)];
      REQUIRE(depth < 1.0F);
      const glm::dvec3 at =
          ray.origin_mm + eye_distance_mm(static_cast<double>(depth), view) * ray.direction;
      worst_mm = std::max(worst_mm, std::abs(glm::length(at) - radius_mm));
      ++hits;
    }
  }
  CHECK(hits > 1000);
  CHECK(worst_mm < 0.15 * 0.25);
}

TEST_CASE("skipping empty cells changes no pixel") {
  if (!have_gl()) return;
  using Contents = std::span<const VolumeContent>;
  check_skipping([](const SceneView& scene,
                    Contents contents) { return std::make_unique<BlendRenderer>(scene, contents); },
                 [](const SceneView& scene, Contents contents) {
                   return std::make_unique<BlendRenderer>(
                       scene, contents, BlendRenderer::Options{.skip_empty = false});
                 });
}

TEST_CASE("after random cuts, uploading the changed bricks equals a fresh upload pixel by pixel") {
  if (!have_gl()) return;
  check_updates([](const SceneView& scene, std::span<const VolumeContent> contents) {
    return std::make_unique<BlendRenderer>(scene, contents);
  });
}

TEST_CASE("an opaque thing inside is dimmed by what lies before it, and by nothing behind") {
  if (!have_gl()) return;
  check_opaque_inside([](const SceneView& scene, std::span<const VolumeContent> contents) {
    return std::make_unique<BlendRenderer>(scene, contents);
  });
}

TEST_CASE("where two volumes intersect both dim, whatever their order and voxel size") {
  if (!have_gl()) return;
  const TestVolume fine = solid_block(glm::dvec3(0.25), {0, 0, 0});
  const TestVolume coarse = solid_block(glm::dvec3(0.5), {0, 0, 0});
  const View view = look_at({0, 0, 30}, {}, 10, 50);
  const double through_fine = transparency(fine, 0.0);
  const double through_coarse = transparency(coarse, 0.0);
  for (const bool swapped : {false, true}) {
    const TestVolume& first = swapped ? coarse : fine;
    const TestVolume& second = swapped ? fine : coarse;
    const std::array<VolumeContent, 2> contents{first.content(), second.content()};
    BlendRenderer renderer(scene_of({&first, &second}), contents);
    const double seen = seen_through(renderer, view, 30.0);
    CHECK(seen == doctest::Approx(shown(through_fine * through_coarse)).epsilon(0.03));
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
  const View view = look_at({0, 0, 30}, {}, 20, 40);
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
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
