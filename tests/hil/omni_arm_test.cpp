// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/omni.hpp"

namespace {

using kerf::DeviceVec;
using kerf::JointVec;
using kerf::OmniArm;

/// Any arm between its end stops.
JointVec<double> any_joints() {
  const auto between = [](double low, double high) {
    constexpr int kSteps = 1'000'000;
    return low + (high - low) * *rc::gen::inRange(0, kSteps + 1) / kSteps;
  };
  const double thigh = between(0.0, 1.75);
  return {between(-0.98, 0.98), thigh, thigh + between(-0.81, 1.25)};
}

double distance(DeviceVec<double> a, DeviceVec<double> b) {
  return norm(a - b);
}

}  // namespace

TEST_CASE("the device origin is where both links open 90 degrees at the data sheet's offsets") {
  // Thigh level, forearm level: the tip is two links in front of the shoulder.
  const OmniArm arm;
  const auto level = arm.tip_mm({0.0, 0.0, kerf::omni::kPi / 2});
  CHECK(level.x == doctest::Approx(0.0));
  CHECK(level.y == doctest::Approx(23.35));
  CHECK(level.z == doctest::Approx(2 * 133.35 - 168.35));
  // Thigh level, forearm hanging.
  const auto hanging = arm.tip_mm({0.0, 0.0, 0.0});
  CHECK(hanging.y == doctest::Approx(23.35 - 133.35));
  CHECK(hanging.z == doctest::Approx(133.35 - 168.35));
  // Turret to the left is negative x.
  CHECK(arm.tip_mm({0.5, 0.3, 0.4}).x < 0);
}

TEST_CASE("inverse kinematics undo forward kinematics in the whole workspace") {
  const OmniArm arm;
  CHECK(rc::check([&] {
    const auto q = any_joints();
    const auto back = arm.joints_rad(arm.tip_mm(q));
    RC_ASSERT(std::abs(back.x - q.x) < 1e-9);
    RC_ASSERT(std::abs(back.y - q.y) < 1e-9);
    RC_ASSERT(std::abs(back.z - q.z) < 1e-9);
    RC_ASSERT(distance(arm.tip_mm(back), arm.tip_mm(q)) < 1e-9);
  }));
}

TEST_CASE("links of other lengths keep the round trip") {
  const OmniArm arm({134.0, 132.5, 35.0, 157.0});
  CHECK(rc::check([&] {
    const auto tip = arm.tip_mm(any_joints());
    RC_ASSERT(distance(arm.tip_mm(arm.joints_rad(tip)), tip) < 1e-9);
  }));
}

TEST_CASE("the Jacobian is the derivative of the tip") {
  const OmniArm arm;
  constexpr double kStep = 1e-6;
  CHECK(rc::check([&] {
    const auto q = any_joints();
    const auto j = arm.jacobian(q);
    for (const auto& unit : {JointVec<double>{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
      const auto ahead = arm.tip_mm(q + unit * kStep);
      const auto behind = arm.tip_mm(q - unit * kStep);
      RC_ASSERT(distance(j * unit, (ahead - behind) * (0.5 / kStep)) < 1e-6);
    }
  }));
}

TEST_CASE("joint torques and tip force do the same work") {
  const OmniArm arm;
  CHECK(rc::check([&] {
    const auto q = any_joints();
    const DeviceVec<double> force{0.3, -1.1, 2.0};
    const auto torque = transposed(arm.jacobian(q)) * force;
    RC_ASSERT(distance(arm.tip_force_n(q, torque), force) < 1e-9);
    const JointVec<double> rates{0.1, -0.7, 0.4};
    RC_ASSERT(norm(arm.joint_rates(q, arm.jacobian(q) * rates) - rates) < 1e-9);
  }));
}

TEST_CASE("an end stop keeps the arm in its range and takes only the speed into it") {
  const OmniArm arm;
  JointVec<double> q{1.2, 0.5, 0.3};  // turret too far left, still turning left and rising
  const JointVec<double> rates{2.0, 0.7, 0.1};
  auto tip = arm.tip_mm(q);
  auto velocity = arm.jacobian({0.98, 0.5, 0.3}) * rates;
  REQUIRE(arm.stop_at_limits(q, tip, velocity));
  CHECK(arm.within_limits(q));
  CHECK(distance(tip, arm.tip_mm(q)) < 1e-9);
  // The turret's direction is at a right angle to the others: their rates stay.
  const auto kept = arm.joint_rates(q, velocity);
  CHECK(std::abs(kept.x) < 1e-9);
  CHECK(kept.y == doctest::Approx(0.7));
  CHECK(kept.z == doctest::Approx(0.1));
  CHECK_FALSE(arm.stop_at_limits(q, tip, velocity));
}

TEST_CASE("the elbow's stop moves with the thigh, and its push is at a right angle to the slide") {
  const OmniArm arm;
  JointVec<double> q{0.0, 1.0, 0.0};  // elbow at -1.0, closing
  auto tip = arm.tip_mm(q);
  const JointVec<double> at_stop{0.0, 1.0, 0.19};
  const auto before = arm.jacobian(at_stop) * JointVec<double>{0.0, 1.0, 0.0};
  auto velocity = before;
  REQUIRE(arm.stop_at_limits(q, tip, velocity));
  CHECK(q.z - q.y == doctest::Approx(-0.81));
  const auto kept = arm.joint_rates(q, velocity);
  CHECK(kept.z - kept.y == doctest::Approx(0.0));
  CHECK(std::abs(dot(before - velocity, velocity)) < 1e-6);
  CHECK(norm(velocity) > 1);
}

TEST_CASE("an end stop lets the arm leave, and never adds speed") {
  const OmniArm arm;
  CHECK(rc::check([&] {
    auto q = any_joints();
    q.x += *rc::gen::inRange(-1, 2) * 1.0;
    q.y += *rc::gen::inRange(-1, 2) * 1.0;
    auto tip = arm.tip_mm(q);
    const auto part = [] { return *rc::gen::inRange(-300, 301) * 1.0; };
    const DeviceVec<double> before{part(), part(), part()};
    auto velocity = before;
    arm.stop_at_limits(q, tip, velocity);
    RC_ASSERT(norm(velocity) <= norm(before) * (1 + 1e-12));
  }));
  JointVec<double> q{1.2, 0.5, 0.3};
  auto tip = arm.tip_mm(q);
  const auto inward = arm.jacobian({0.98, 0.5, 0.3}) * JointVec<double>{-2.0, 0.7, 0.1};
  auto velocity = inward;
  REQUIRE(arm.stop_at_limits(q, tip, velocity));
  CHECK(velocity == inward);
}
