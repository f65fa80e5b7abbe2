// SPDX-License-Identifier: Apache-2.0
// What the servo puts out, books and forgets beside the force: filters in time, refused starts,
// gaps, a new tool.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <doctest/doctest.h>

#include "tests/rig/cutting_hand.hpp"
#include "tests/servo/support.hpp"

namespace kerf::output_and_reset_test {

using namespace kerf::test;
using extremes::CuttingHand;

namespace {

/// The yaw after the pots have stood elsewhere for `ms`.
double yaw_after(int rate_hz, double ms) {
  LoadedScene scene = half_space_scene(8);
  scene.servo.rate_hz = rate_hz;
  ArmedServo armed(scene, {0, 5, 0}, std::max(1, rate_hz / 1000));
  ServoOutput out;
  for (int tick = 0; tick < std::lround(ms * rate_hz / 1000); ++tick) {
    DeviceReport report = armed.arm.at(0, 5, 0);
    report.wiper_a[0] = 0x8800;
    report.wiper_b[0] = 0x7800;
    out = armed.servo->step(report);
  }
  return out.gimbal_rad[0];
}

}  // namespace

TEST_CASE("the gimbal is smoothed over 20 ms at any rate") {
  for (const int rate_hz : {250, 1000, 4000, 8000}) {
    CAPTURE(rate_hz);
    const double centred = yaw_after(rate_hz, 0.0), moved = yaw_after(rate_hz, 100);
    REQUIRE(std::abs(moved - centred) > 0.1);
    CHECK(yaw_after(rate_hz, 20) == moved);
    const double half_way = (yaw_after(rate_hz, 8) - centred) / (moved - centred);
    CHECK(half_way == doctest::Approx(0.4).epsilon(0.02));
  }
}

TEST_CASE("a tool that finds no free place is told, and feels nothing until it has one") {
  LoadedScene scene = half_space_scene(8);
  scene.volumes[0] = volume_of(192, kVoxelMm, [](double, double, double) { return -1.0; });
  const auto& dock = omni::kDockRad;
  const auto inkwell = OmniArm().tip_mm({dock[0], dock[1], dock[2]});
  scene.device.offset_mm = {-inkwell.x, -inkwell.y, -inkwell.z};  // in the middle of the block
  ArmedServo armed(scene, {inkwell.x, inkwell.y + 1, inkwell.z});
  const ServoOutput inside = armed.settled(inkwell.x, inkwell.y + 1, inkwell.z);
  CHECK(inside.refused);
  CHECK(length(inside.contact_force_n) == 0);
  double up_mm = 1;
  for (; up_mm < 16; up_mm += 0.05) {
    static_cast<void>(armed.step(inkwell.x, inkwell.y + up_mm, inkwell.z));
  }
  CHECK_FALSE(armed.settled(inkwell.x, inkwell.y + up_mm, inkwell.z).refused);
}

TEST_CASE("a new tool stands still and rubs nothing") {
  LoadedScene scene = half_space_scene(48);
  scene.cut.model = CutModel::preston;
  scene.tools.push_back(ball(8));
  CuttingHand miller(scene);
  const ServoOutput cutting = miller.hold({0, 0.2, 0}, 0.1);
  REQUIRE(length(cutting.modification_n) > 0.05);
  REQUIRE(cutting.spindle_ratio > 0.5);
  CHECK(miller.servo().apply({.kind = ServoCommand::Kind::select_tool, .argument = 1}));
  const ServoOutput after = miller.step({0, 0.2, 0});
  CHECK(length(after.modification_n) == 0);
  CHECK(after.spindle_ratio < 0.1);
}

}  // namespace kerf::output_and_reset_test
