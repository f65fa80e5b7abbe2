// SPDX-License-Identifier: Apache-2.0
// N12 in the pictures: every renderer with a surface, on bodies whose surface is known.
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "tests/visualizer/render/exact_body.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/bench/picture_bench.hpp"

namespace kerf::second_order_test {

using namespace kerf::test;

namespace {

const View kView = look_at({7, 15, 19}, {}, 15, 40);

/// Root mean square over the pixels whose surface is not seen on edge; `square_at` is told a pixel,
/// its exact place in world mm and the outward normal there.
template <class SquareAt>
double root_mean_square(const Distance& distance, const SquareAt& square_at) {
  double sum = 0.0;
  int hits = 0;
  for_each_pixel(kView, [&](std::size_t at, const PixelRay& ray) {
    const auto exact = exact_mm(distance, ray);
    if (!exact) return;
    const glm::dvec3 normal = slope_of(distance, ray.origin_mm + *exact * ray.direction);
    if (-glm::dot(normal, glm::normalize(ray.direction)) < kLeastFacing) return;
    sum += square_at(at, *exact, normal);
    ++hits;
  });
  CHECK(hits > 500);
  return std::sqrt(sum / hits);
}

TestVolume volume_of(const Distance& distance, double spacing_mm) {
  const int n = static_cast<int>(std::lround(12.0 / spacing_mm)) + 1;
  const VoxelGrid grid{n, n, n};
  return {grid, centred(grid, glm::dvec3(spacing_mm)), body(distance, 3.0)};
}

double depth_error_mm(const std::string& kind, const Distance& distance, double spacing_mm) {
  const TestVolume volume = volume_of(distance, spacing_mm);
  const VolumeContent content = volume.content();
  const auto renderer = make_renderer(kind, scene_of({&volume}), {&content, 1});
  const Drawn drawn = draw(*renderer, kView, RenderTarget(kTestSize));
  return root_mean_square(distance, [&](std::size_t at, double exact_mm, const glm::dvec3&) {
    const float depth = drawn.depth[at];
    REQUIRE(depth < 1.0F);
    return std::pow(eye_distance_mm(static_cast<double>(depth), kView) - exact_mm, 2);
  });
}

/// Length of the difference of unit normals, as the shaders of iso have them.
double normal_error(GradientFilter gradient, const Distance& distance, double spacing_mm) {
  const TestVolume volume = volume_of(distance, spacing_mm);
  const VolumeContent content = volume.content();
  SceneView scene = scene_of({&volume});
  scene.gradient = gradient;
  IsoRenderer renderer(scene, {&content, 1}, {.light = "normals.frag"});
  const Drawn drawn = draw(renderer, kView, RenderTarget(kTestSize));
  return root_mean_square(distance, [&](std::size_t at, double, const glm::dvec3& normal) {
    const glm::dvec3 seen = shown_normal(&drawn.rgb[3 * at]);
    const glm::dvec3 off = seen - glm::dvec3(kView.eye_from_world * glm::dvec4(normal, 0.0));
    return glm::dot(off, off);
  });
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

TEST_CASE("N12: the normals of iso are of second order in the voxel, from every gradient") {
  if (!have_gl()) return;
  for (const GradientFilter gradient :
       {GradientFilter::central, GradientFilter::corners, GradientFilter::farid5}) {
    CAPTURE(static_cast<int>(gradient));
    for (const Distance& distance : {Distance(ball_distance), Distance(torus_distance)}) {
      const double coarse = normal_error(gradient, distance, 0.5);
      const double fine = normal_error(gradient, distance, 0.25);
      CAPTURE(coarse);
      CAPTURE(fine);
      CHECK(std::log2(coarse / fine) == doctest::Approx(2.0).epsilon(0.1));
      CHECK(fine < 0.01);
    }
  }
}

}  // namespace kerf::second_order_test
