// SPDX-License-Identifier: Apache-2.0
// The swept proxy in the whole servo step: from joint counts to the force of the hand.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "controller/tool/tool_shapes.hpp"
#include "tests/servo/support.hpp"

namespace kerf::swept_scene_test {

using namespace kerf::test;

namespace {

/// Solid below y = 0 with an edge of two voxels, a ball of radius 1 mm, nothing cut.
LoadedScene swept_scene(NumericKind numeric) {
  LoadedScene scene = half_space_scene(48);
  scene.volumes[0] = volume_of(48, kVoxelMm, [](double, double y, double) { return y / 2; });
  scene.servo.numeric = numeric;
  return scene;
}

}  // namespace

TEST_CASE("the force is stiffness times depth, along the normal, in every kind of numbers") {
  for (const auto numeric : {NumericKind::fixed, NumericKind::float64}) {
    CAPTURE(static_cast<int>(numeric));
    LoadedScene scene = swept_scene(numeric);
    ArmedServo armed(scene, {0, 3, 0});
    CHECK(length(armed.settled(0, 1.2, 0).commanded_force_n) == 0);  // the ball ends at 0.2
    for (const double y_mm : {0.8, 0.3, -0.5, -2.0}) {
      const ServoOutput out = armed.settled(0.1, y_mm, 0.2);
      // A count of the encoders is up to 0.06 mm, so the depth is that of the place that was read.
      const double depth_mm = 1 - out.position_mm[1];
      CHECK(out.commanded_force_n[1] == doctest::Approx(0.4 * depth_mm).epsilon(0.02));
      CHECK(out.proxy_offset_mm[1] == doctest::Approx(depth_mm).epsilon(0.02));
      CHECK(std::hypot(out.commanded_force_n[0], out.commanded_force_n[2]) <
            0.02 * out.commanded_force_n[1]);
      CHECK(length(out.tip_torque_n_mm) < 0.05 * out.commanded_force_n[1]);  // of a ball: none
      CHECK(armed.servo->penetration_mm() == doctest::Approx(depth_mm).epsilon(0.02));
    }
  }
}

TEST_CASE("a workspace scale leaves the stiffness at the device as it is") {
  LoadedScene scene = swept_scene(NumericKind::fixed);
  scene.device.workspace_scale = 0.5;
  ArmedServo armed(scene, {0, 6, 0});
  const ServoOutput out = armed.settled(0, 1, 0);
  CHECK(out.commanded_force_n[1] ==
        doctest::Approx(0.4 * (1 - out.position_mm[1]) / 0.5).epsilon(0.02));
}

TEST_CASE("a larger tool that takes over under pressure is pushed out with a ramp") {
  LoadedScene scene = swept_scene(NumericKind::fixed);
  scene.tools.push_back(ball(32));
  ArmedServo armed(scene, {0, 5, 0});
  static_cast<void>(armed.settled(0, -0.5, 0));  // 1.5 mm deep: the small ball rests at 1 mm
  CHECK(armed.servo->apply({.kind = ServoCommand::Kind::select_tool, .argument = 1}));
  double last_n = 0, most_n = 0;
  for (int tick = 0; tick < 200; ++tick) {
    const ServoOutput out = armed.step(0, -0.5, 0);
    CHECK(length(out.contact_force_n) <= last_n + 0.1 + 1e-3);
    last_n = length(out.contact_force_n);
    most_n = std::max(most_n, last_n);
  }
  CHECK(most_n == doctest::Approx(0.4 * 2.5).epsilon(0.05));
}

TEST_CASE("a tool that turns is held by its whole shape, and its torque is told") {
  LoadedScene scene = swept_scene(NumericKind::fixed);
  scene.tools = {
      make_tool("shaft", "cylinder", {.pitch_mm = kVoxelMm, .radius_mm = 0.5, .length_mm = 3.0})};
  // A step: the shaft's tip is over the low side, its flank against the edge of the high one.
  scene.volumes[0] = volume_of(
      48, kVoxelMm, [](double x, double y, double) { return std::max(y - 0.5, 1.0 - x) / 2; });
  ArmedServo armed(scene, {0, 3, 0});
  static_cast<void>(armed.settled(0, -0.5, 0));
  const ServoOutput out = armed.settled(0.9, -0.5, 0);  // the flank meets the wall x = 1
  CHECK(out.commanded_force_n[0] < -0.1);
  CHECK(out.position_mm[0] + out.proxy_offset_mm[0] == doctest::Approx(0.5).epsilon(0.05));
  // Only the lower half of the flank is pushed: the force acts below the middle.
  CHECK(out.tip_torque_n_mm[2] < -0.02);
}

TEST_CASE("a scene pays only for the force that it names") {
  const auto has = [](const LoadedScene& scene, const std::string& name) {
    const auto compiled = plan_scene(scene);
    const auto& arrays = compiled->costs().arrays;
    return std::any_of(arrays.begin(), arrays.end(), [&](const ArrayBytes& array) {
      return array.name.find(name) != std::string::npos;
    });
  };
  LoadedScene scene = paper_scene(16);
  CHECK_FALSE(has(scene, "surface"));
  CHECK(has(scene, "table"));
  scene.force.model = ForceModel::proxy;
  CHECK(has(scene, "surface"));
  CHECK_FALSE(has(scene, "table"));
  scene.cut.model = CutModel::overlap;
  CHECK(has(scene, "table"));
}

}  // namespace kerf::swept_scene_test
