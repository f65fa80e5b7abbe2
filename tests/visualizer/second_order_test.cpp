// SPDX-License-Identifier: Apache-2.0
// N12 in the pictures: every renderer with a surface, on bodies whose surface is known.
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "tests/visualizer/exact_body.hpp"
#include "tests/visualizer/renderer_fixture.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// Root mean square of the depth's error in mm, where the surface is not seen on edge.
double depth_error_mm(const std::string& kind, const Distance& distance, double spacing_mm) {
  const int n = static_cast<int>(std::lround(12.0 / spacing_mm)) + 1;
  const VoxelGrid grid{n, n, n};
  const TestVolume volume(grid, centred(grid, glm::dvec3(spacing_mm)), body(distance, 3.0));
  const VolumeContent content = volume.content();
  const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
  const View view = look_at({7, 15, 19}, {}, 15, 40);
  const Drawn drawn = draw(*renderer, view, RenderTarget(kTestSize));
  double sum = 0.0;
  int hits = 0;
  for (int y = 0; y < kTestSize.height; ++y) {
    for (int x = 0; x < kTestSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kTestSize, x, y);
      const auto exact = exact_mm(distance, ray);
      if (!exact) continue;
      const glm::dvec3 normal = slope_of(distance, ray.origin_mm + *exact * ray.direction);
      if (-glm::dot(normal, glm::normalize(ray.direction)) < kLeastFacing) continue;
      const float depth = drawn.depth[pixel_at(x, y)];
      REQUIRE(depth < 1.0F);
      sum += std::pow(eye_distance_mm(static_cast<double>(depth), view) - *exact, 2);
      ++hits;
    }
  }
  CHECK(hits > 500);
  return std::sqrt(sum / hits);
}

}  // namespace

TEST_CASE("N12: the depth of a ball and a torus is of second order in the voxel") {
  if (!have_gl()) return;
  for (const char* kind : {"iso", "surface", "cast"}) {
    CAPTURE(std::string(kind));
    for (const Distance& distance : {Distance(ball_distance), Distance(torus_distance)}) {
      const double coarse = depth_error_mm(kind, distance, 0.4);
      const double fine = depth_error_mm(kind, distance, 0.2);
      CAPTURE(coarse);
      CAPTURE(fine);
      CHECK(std::log2(coarse / fine) == doctest::Approx(2.0).epsilon(0.1));
      CHECK(fine < 0.05 * 0.2);
    }
  }
}
