// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/air_speed.hpp"

#include <algorithm>
#include <vector>

#include <doctest/doctest.h>

#include "controller/plan/compile.hpp"
#include "tests/plan/costs_support.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

std::vector<double> speeds(const LoadedScene& scene) {
  return plan_scene(scene)->costs().air_speeds_mm_per_s;
}

}  // namespace

TEST_CASE("how fast a hand may go in air is told for each tool, by rate, voxel and scale") {
  LoadedScene scene = half_space_scene(16);
  scene.force.model = ForceModel::proxy;
  scene.servo.numeric = NumericKind::fixed;
  scene.tools = {ball(8), shape("cylinder", 0.5, 2)};
  const auto usual = speeds(scene);
  REQUIRE(usual.size() == 2);
  for (const double speed : usual) {
    // At least 8 queries a tick, at most 31.
    CHECK(speed > 8 * 0.875 * kVoxelMm * scene.servo.rate_hz);
    CHECK(speed <= 31 * 0.875 * kVoxelMm * scene.servo.rate_hz);
  }
  scene.device.workspace_scale = 0.5;
  CHECK(speeds(scene)[0] == doctest::Approx(2 * usual[0]));
  scene.servo.rate_hz /= 4;
  CHECK(speeds(scene)[0] == doctest::Approx(usual[0] / 2));
  scene.servo.numeric = NumericKind::float64;
  CHECK(speeds(scene)[0] == doctest::Approx(usual[0] / 2));
  scene.force.model = ForceModel::paper;
  CHECK(speeds(scene).empty());
}
