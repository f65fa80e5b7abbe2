// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/wooden.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::ArmPose;
using kerf::DeviceVec;
using kerf::JointVec;
using kerf::WoodenArm;

/// The makers' formula, in their axes (x to the user, y right, z up), in mm.
DeviceVec<double> makers_tip(JointVec<double> q) {
  const double reach = 205 * std::sin(q.y) + 245 * std::sin(q.z);
  const double x = std::cos(q.x) * reach - 220;
  const double y = std::sin(q.x) * reach;
  const double z = 80 + 205 * std::cos(q.y) - 245 * std::cos(q.z) - 80;
  return {y, z, x};
}

JointVec<double> any_joints() {
  const auto between = [](double low, double high) {
    return low + (high - low) * *rc::gen::inRange(0, 1'000'001) / 1e6;
  };
  const double b = between(-0.35, 1.35);
  return {between(-1.0, 1.0), b, between(0.45, 2.6) - b};
}

}  // namespace

TEST_CASE("the WoodenHaptics tip is where the makers' formula puts it, both ways") {
  const WoodenArm arm;
  CHECK(rc::check([&] {
    const auto q = any_joints();
    RC_ASSERT(arm.within_limits(q));
    RC_ASSERT(norm(arm.tip_mm(q) - makers_tip(q)) < 1e-9);
    RC_ASSERT(norm(arm.joints_rad(makers_tip(q)) - q) < 1e-9);
  }));
  const auto home = arm.tip_mm({0, 0, std::numbers::pi / 2});
  CHECK(norm(home - DeviceVec<double>{0, 205, 25}) < 1e-9);
  CHECK(arm.tip_mm({0.3, 0.3, 0.7}).x > 0);  // A turns to the right
}

TEST_CASE("rates and forces of WoodenHaptics follow the makers' formula") {
  const WoodenArm arm;
  constexpr double kStep = 1e-6;
  CHECK(rc::check([&] {
    const auto q = any_joints();
    const ArmPose pose{q, arm.tip_mm(q)};
    const auto part = [] { return *rc::gen::inRange(-100, 101) * 0.01; };
    const JointVec<double> rates{part(), part(), part()};
    const auto velocity =
        (makers_tip(q + rates * kStep) - makers_tip(q - rates * kStep)) * (0.5 / kStep);
    RC_ASSERT(norm(arm.joint_rates(pose, velocity) - rates) < 1e-6);
    const JointVec<double> torque{part(), part(), part()};
    const double power = dot(torque, rates);
    RC_ASSERT(std::abs(dot(arm.tip_force_n(pose, torque), velocity) - power) < 1e-5);
  }));
}

TEST_CASE("the WoodenHaptics end stops keep the arm in its range") {
  const WoodenArm arm;
  JointVec<double> q{0.2, 1.5, 0.3};  // leans too far out, still going
  auto tip = arm.tip_mm(q);
  auto velocity = tip - arm.tip_mm(q - JointVec<double>{0, 0.01, 0});
  const double before = norm(velocity);
  REQUIRE(arm.stop_at_limits(q, tip, velocity));
  CHECK(arm.within_limits({q.x, q.y - 1e-12, q.z}));
  CHECK(q.y == doctest::Approx(1.35));
  CHECK(norm(tip - arm.tip_mm(q)) < 1e-9);
  CHECK(norm(velocity) < before);
  CHECK_FALSE(arm.stop_at_limits(q, tip, velocity));
}
