// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/camera.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

/// Half widths and half heights of the picture from its middle.
glm::dvec2 seen_at(const View& view, glm::dvec3 world_mm) {
  const glm::dvec4 clip = view.clip_from_eye() * view.eye_from_world * glm::dvec4(world_mm, 1.0);
  return glm::dvec2(clip) / clip.w;
}

/// The middle column of what is drawn, in half widths from the picture's middle.
double middle_of(const Drawn& drawn, PictureSize size) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < drawn.depth.size(); ++i) {
    if (drawn.depth[i] >= 1.0F) continue;
    sum += static_cast<double>(i % static_cast<std::size_t>(size.width)) + 0.5;
    count += 1.0;
  }
  REQUIRE(count > 50.0);
  return sum / count / size.width * 2.0 - 1.0;
}

}  // namespace

TEST_CASE("disparity is that of the formula: none at the convergence distance, none up or down") {
  CHECK(rc::check([] {
    const auto real = [](int lo, int hi) { return *rc::gen::inRange(lo, hi) * 1e-3; };
    View middle = look_at({3.0, 4.0, 60.0}, {1.0, 0.0, 0.0}, 1.0, 500.0);
    middle.aspect = real(300, 3000);
    const StereoBase base{real(-9000, 9000), real(1000, 200'000)};
    const auto [left, right] = eye_views(middle, base);
    const double z = real(1000, 200'000);
    const glm::dvec3 in_eye{real(-20'000, 20'000), real(-20'000, 20'000), -z};
    const glm::dvec3 world(glm::inverse(middle.eye_from_world) * glm::dvec4(in_eye, 1.0));
    const glm::dvec2 between = seen_at(left, world) - seen_at(right, world);
    const double half_width = middle.tan_half_height * middle.aspect;
    const double expected = base.eyes_mm * (1.0 / z - 1.0 / base.convergence_mm) / half_width;
    RC_ASSERT(std::abs(between.x - expected) < 1e-9);
    RC_ASSERT(std::abs(between.y) < 1e-12);
  }));
}

TEST_CASE("every renderer draws both eyes where the formula says") {
  if (!have_gl()) return;
  const VoxelGrid grid{40, 40, 40};
  const PictureSize size{160, 120};
  const RenderTarget target(size);
  View middle = look_at({0, 0, 30}, {}, 5.0, 80.0);
  middle.aspect = 4.0 / 3.0;
  for (const double z_mm : {30.0, 24.0, 40.0}) {
    const TestVolume volume(grid, centred(grid, glm::dvec3(0.1), {0.5, 0.3, 30.0 - z_mm}),
                            ball({0.5, 0.3, 30.0 - z_mm}, 1.4, 0.3));
    const VolumeContent content = volume.content();
    SceneView scene;
    scene.volumes.push_back(volume.view);
    const StereoBase base{2.0, 30.0};
    const auto [left, right] = eye_views(middle, base);
    for (const std::string_view kind : renderer_kinds()) {
      CAPTURE(std::string(kind));
      CAPTURE(z_mm);
      const auto renderer = make_renderer(kind, scene, {&content, 1});
      const double between = middle_of(draw(*renderer, left, target), size) -
                             middle_of(draw(*renderer, right, target), size);
      const double expected = base.eyes_mm * (1.0 / z_mm - 1.0 / base.convergence_mm) /
                              (middle.tan_half_height * middle.aspect);
      constexpr double kPixel = 2.0 / 160.0;
      CHECK(between == doctest::Approx(expected).scale(1.0).epsilon(0.3 * kPixel));
    }
  }
}
