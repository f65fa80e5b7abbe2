// SPDX-License-Identifier: Apache-2.0
// The iso renderer against spheres, whose depth is known.
#include <algorithm>
#include <cmath>
#include <optional>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/scene/visualizer_error.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// Distance along the view axis at which the ray of a pixel enters a sphere.
std::optional<double> sphere_mm(const PixelRay& ray, glm::dvec3 centre_mm, double radius_mm) {
  const glm::dvec3 from = ray.origin_mm - centre_mm;
  const double a = glm::dot(ray.direction, ray.direction);
  const double b = glm::dot(from, ray.direction);
  const double c = glm::dot(from, from) - radius_mm * radius_mm;
  if (b * b < a * c) return std::nullopt;
  return (-b - std::sqrt(b * b - a * c)) / a;
}

struct DepthError {
  double rms_mm = 0.0;
  int hits = 0;
  int missed = 0;  ///< well inside the disc, and not drawn
};

/// Compares all pixels with a sphere; the outermost millimetres, where depth has no slope, only
/// count as hit or not.
DepthError compare_with_sphere(const Drawn& drawn, const View& view, glm::dvec3 centre_mm,
                               double radius_mm) {
  DepthError error;
  for (int y = 0; y < kTestSize.height; ++y) {
    for (int x = 0; x < kTestSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kTestSize, x, y);
      if (!sphere_mm(ray, centre_mm, 0.97 * radius_mm)) continue;
      const float depth = drawn.depth[static_cast<std::size_t>(y * kTestSize.width + x)];
      if (depth >= 1.0F) {
        ++error.missed;
        continue;
      }
      const double off =
          eye_distance_mm(static_cast<double>(depth), view) - *sphere_mm(ray, centre_mm, radius_mm);
      error.rms_mm += off * off;
      ++error.hits;
    }
  }
  error.rms_mm = std::sqrt(error.rms_mm / std::max(error.hits, 1));
  return error;
}

}  // namespace

TEST_CASE("the depth of a ball is that of the sphere, to a tenth of a voxel") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 4.0, 0.5));
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  const View view = look_at({9, 14, 17}, {}, 15, 35);
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
  const DepthError error = compare_with_sphere(drawn, view, {}, 4.0);
  CHECK(error.missed == 0);
  CHECK(error.hits > 1500);
  CHECK(error.rms_mm < 0.1 * 0.25);
}

TEST_CASE(
    "rays that begin and end inside one body begin there, whatever lies beyond the far plane") {
  if (!have_gl()) return;
  // A wide body around the eye, a gap, and a thin one. Rays leave the gap in a higher row of cells
  // than they came into it by, and enter the thin body by a later face than they leave it by.
  const VoxelGrid grid{120, 24, 120};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), [](glm::dvec3 at) {
    return at.x > 0.0 || (at.x < -10.0 && at.x > -12.0) ? 1.0 : 0.0;
  });
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  const glm::dvec3 eye(6.0, 0.1, -9.0);
  View view = look_at(eye, eye + glm::dvec3(-1.0, 0.0, 0.45), 0.5, 2.0);
  view.tan_half_height = 0.1;
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
  int holes = 0;
  for (const float depth : drawn.depth) holes += depth >= 1.0F ? 1 : 0;
  CHECK(holes == 0);
}

TEST_CASE("unequal voxel edges and a turned volume give the same sphere") {
  if (!have_gl()) return;
  const VoxelGrid grid{50, 36, 24};
  const glm::dmat4 turned = glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(1, -2, 0.5)),
                                        0.7, glm::normalize(glm::dvec3(1, 2, 3))) *
                            centred(grid, {0.2, 0.3, 0.5});
  const TestVolume volume(grid, turned, ball({1, -2, 0.5}, 4.0, 0.6));
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  const View view = look_at({-15, 3, 14}, {1, -2, 0.5}, 12, 34);
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
  const DepthError error = compare_with_sphere(drawn, view, {1, -2, 0.5}, 4.0);
  CHECK(error.missed == 0);
  CHECK(error.rms_mm < 0.1 * 0.3);
}

TEST_CASE("skipping empty cells changes no pixel") {
  if (!have_gl()) return;
  using Contents = std::span<const VolumeContent>;
  check_skipping([](const SceneView& scene,
                    Contents contents) { return std::make_unique<IsoRenderer>(scene, contents); },
                 [](const SceneView& scene, Contents contents) {
                   return std::make_unique<IsoRenderer>(scene, contents,
                                                        IsoRenderer::Options{.skip_empty = false});
                 });
}

TEST_CASE("after random cuts, uploading the changed bricks equals a fresh upload pixel by pixel") {
  if (!have_gl()) return;
  check_updates([](const SceneView& scene, std::span<const VolumeContent> contents) {
    return std::make_unique<IsoRenderer>(scene, contents);
  });
}

TEST_CASE("with the eye inside the volume's box the hollow around it is seen whole") {
  if (!have_gl()) return;
  const VoxelGrid grid{48, 48, 48};
  // Solid with a ball-shaped hollow in the middle.
  const auto hollow = ball({}, 3.0, 0.5);
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)),
                          [&](glm::dvec3 at) { return 1.0 - std::clamp(hollow(at), 0.0, 1.0); });
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  const View view = look_at({0.2, 0.1, 0}, {1, 2, 3}, 0.05, 20);
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
  double worst_mm = 0.0;
  for (int y = 0; y < kTestSize.height; ++y) {
    for (int x = 0; x < kTestSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kTestSize, x, y);
      const float depth = drawn.depth[static_cast<std::size_t>(y * kTestSize.width + x)];
      const glm::dvec3 at =
          ray.origin_mm + eye_distance_mm(static_cast<double>(depth), view) * ray.direction;
      worst_mm = std::max(worst_mm, std::abs(glm::length(at) - 3.0));
    }
  }
  CHECK(worst_mm < 0.25 * 0.25);
}

TEST_CASE("a volume that is solid up to its border is closed there") {
  if (!have_gl()) return;
  const VoxelGrid grid{16, 16, 16};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.5)), [](glm::dvec3) { return 1.0; });
  const VolumeContent content = volume.content();
  IsoRenderer renderer(scene_of({&volume}), {&content, 1});
  const View view = look_at({0, 0, 30}, {}, 10, 50);
  const Drawn drawn = draw(renderer, view, RenderTarget(kTestSize));
  const float depth = drawn.depth[static_cast<std::size_t>(kTestSize.height / 2 * kTestSize.width +
                                                           kTestSize.width / 2)];
  // Half density half a voxel beyond the last centre: z = 7.5 * 0.5 + 0.25.
  CHECK(eye_distance_mm(static_cast<double>(depth), view) == doctest::Approx(26.0).epsilon(0.001));
}

TEST_CASE("a volume beyond the driver's limit is refused, and the limit is named") {
  if (!have_gl()) return;
  const VoxelGrid grid{31, 8, 8};
  const TestVolume volume(grid, glm::dmat4(1.0), [](glm::dvec3) { return 0.0; });
  CHECK_NOTHROW(VolumeOnGpu(volume.view, volume.content(), 33, true));
  CHECK_THROWS_WITH_AS(
      VolumeOnGpu(volume.view, volume.content(), 32, true),
      "volume test: 31x8x8 voxels, and this OpenGL driver takes 30 a side; crop or "
      "resample it",
      VisualizerError);
}
