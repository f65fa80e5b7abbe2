// SPDX-License-Identifier: Apache-2.0
// Kinematics of the three arms: against their data sheets and sources, and as derivatives of each
// other.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "tests/hil/model_runs.hpp"

namespace kerf::arms_test {
namespace {

using kerf::falcon::kRadPerCount;
using kerf::falcon::kRadPerDegree;
using kerf::omni::kPi;

double between(double low, double high) {
  constexpr int kSteps = 1'000'000;
  return low + (high - low) * *rc::gen::inRange(0, kSteps + 1) / kSteps;
}
DeviceVec<double> any_vector(double largest) {
  return {between(-largest, largest), between(-largest, largest), between(-largest, largest)};
}

/// Any joints between the end stops, and often at them: at one, two or three of them at once.
template <class Arm>
JointVec<double> any_joints(const Arm& arm) {
  JointVec<double> q{between(-1.2, 1.2), between(-0.6, 2.2), between(-1.2, 3.2)};
  DeviceVec<double> tip = arm.tip_mm(q), still;
  arm.stop_at_limits(q, tip, still);
  return q;
}
/// Not in the outermost millimetre, where the differences below err by more than they may.
JointVec<double> any_joints(const FalconArm& arm) {
  return arm.joints_rad(kerf::test::any_in_ball(kerf::falcon::kReachMm - 1));
}

/// A grip counted from the hips' plane, as the sources do.
DeviceVec<double> from_hips(double x, double y, double z) {
  return {x, y, z - kerf::falcon::kOriginDepthMm};
}

/// The formula of WoodenHaptics' makers, in their axes (x to the user, y right, z up), in mm.
DeviceVec<double> makers_tip(JointVec<double> q) {
  const double reach = 205 * std::sin(q.y) + 245 * std::sin(q.z);
  const double x = std::cos(q.x) * reach - 220;
  const double y = std::sin(q.x) * reach;
  const double z = 80 + 205 * std::cos(q.y) - 245 * std::cos(q.z) - 80;
  return {y, z, x};
}

/// The velocity of a tip and the joint rates of the same motion, by differences: forwards if the
/// forward kinematics are exact, else (the Falcon's iterate) backwards.
struct Motion {
  DeviceVec<double> velocity;
  JointVec<double> rates;
};
template <class Arm>
Motion any_motion(const Arm& arm, const ArmPose& pose) {
  constexpr double kStepS = 1e-6;
  const JointVec<double> rates{between(-1, 1), between(-1, 1), between(-1, 1)};
  const JointVec<double> step = rates * kStepS;
  return {(arm.tip_mm(pose.q + step) - arm.tip_mm(pose.q - step)) * (0.5 / kStepS), rates};
}
Motion any_motion(const FalconArm& arm, const ArmPose& pose) {
  constexpr double kStepS = 1e-5;
  const DeviceVec<double> velocity = any_vector(1), step = velocity * kStepS;
  return {velocity, (arm.joints_rad(pose.tip_mm + step) - arm.joints_rad(pose.tip_mm - step)) *
                        (0.5 / kStepS)};
}

/// Holds for each arm: joints and tip are inverses, rates are the derivative, forces do the work of
/// torques.
template <class Arm>
void check_kinematics(const Arm& arm) {
  CHECK(rc::check([&] {
    const JointVec<double> q = any_joints(arm);
    const ArmPose pose{q, arm.tip_mm(q)};
    RC_ASSERT(norm(arm.joints_rad(pose.tip_mm) - q) < 1e-8);
    const Motion motion = any_motion(arm, pose);
    // Differences err by their rounding, 2^-53 of 300 mm over 1e-6 s, at 8 mm from an axis or more.
    RC_ASSERT(norm(arm.joint_rates(pose, motion.velocity) - motion.rates) < 1e-7);
    const JointVec<double> torque{between(-1, 1), between(-1, 1), between(-1, 1)};
    const double power = dot(torque, motion.rates);
    RC_ASSERT(std::abs(dot(arm.tip_force_n(pose, torque), motion.velocity) - power) < 1e-5);
  }));
}

/// An end stop keeps the arm in its range, and never adds speed.
template <class Arm>
void check_stops(const Arm& arm) {
  CHECK(rc::check([&] {
    DeviceVec<double> tip = arm.tip_mm(any_joints(arm)) + any_vector(30);
    JointVec<double> q = arm.joints_rad(tip);
    const DeviceVec<double> before = any_vector(300);
    DeviceVec<double> velocity = before;
    const bool stopped = arm.stop_at_limits(q, tip, velocity);
    RC_ASSERT(norm(velocity) <= norm(before) * (1 + 1e-12));
    RC_ASSERT(norm(tip - arm.tip_mm(q)) < 1e-6);
    RC_ASSERT(stopped || velocity == before);
  }));
}

}  // namespace

TEST_CASE("joints, tip, rates and forces of each arm belong together in the whole workspace") {
  check_kinematics(OmniArm{});
  check_kinematics(OmniArm({134.0, 132.5, 35.0, 157.0}));
  check_kinematics(FalconArm{});
  check_kinematics(WoodenArm{});
}

TEST_CASE("two links: the tip stays in front of the turret's axis, whichever stops meet") {
  const auto forward_mm = [](const auto& arm, JointVec<double> beyond, double depth_mm) {
    DeviceVec<double> tip = arm.tip_mm(beyond), still;
    arm.stop_at_limits(beyond, tip, still);
    return arm.tip_mm({0, beyond.y, beyond.z}).z + depth_mm;
  };
  constexpr int kSteps = 60;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const JointVec<double> q{0, -1.0 + 4.0 * i / kSteps, -1.5 + 5.0 * j / kSteps};
      CHECK(forward_mm(OmniArm{}, q, kerf::omni::kOriginDepthMm) > 10);
      CHECK(forward_mm(WoodenArm{}, q, kerf::wooden::kOriginDepthMm) > 8);
    }
  }
}

TEST_CASE("the end stops of each arm never add speed") {
  check_stops(OmniArm{});
  check_stops(FalconArm{});
  check_stops(WoodenArm{});
}

TEST_CASE("omni: the origin is where both links open 90 degrees at the data sheet's offsets") {
  // Thigh level, forearm level: the tip is two links in front of the shoulder.
  const OmniArm arm;
  const auto level = arm.tip_mm({0.0, 0.0, kPi / 2});
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

TEST_CASE("omni: an end stop keeps the arm in its range and takes only the speed into it") {
  const OmniArm arm;
  for (const double turning : {2.0, -2.0}) {  // further, and back
    CAPTURE(turning);
    JointVec<double> q{1.2, 0.5, 0.3};  // turret too far left, rising
    auto tip = arm.tip_mm(q);
    const auto before = arm.jacobian({0.98, 0.5, 0.3}) * JointVec<double>{turning, 0.7, 0.1};
    auto velocity = before;
    REQUIRE(arm.stop_at_limits(q, tip, velocity));
    CHECK(arm.within_limits(q));
    CHECK(norm(tip - arm.tip_mm(q)) < 1e-9);
    if (turning < 0) {
      CHECK(velocity == before);
      continue;
    }
    // The turret's direction is at a right angle to the others: their rates stay.
    const auto kept = arm.joint_rates(q, velocity);
    CHECK(std::abs(kept.x) < 1e-9);
    CHECK(kept.y == doctest::Approx(0.7));
    CHECK(kept.z == doctest::Approx(0.1));
    CHECK_FALSE(arm.stop_at_limits(q, tip, velocity));
  }
}

TEST_CASE(
    "omni: the elbow's stop moves with the thigh, its push is at a right angle to the slide") {
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

TEST_CASE("falcon: the joints have the golden angles, and a count is 0.046 mm along the axis") {
  const FalconArm arm;
  struct Golden {
    DeviceVec<double> tip_mm;
    std::array<double, 3> degrees;
  };
  for (const auto& [tip_mm, degrees] :
       {Golden{from_hips(0, 0, 110), {16.188, 16.188, 16.188}},
        Golden{from_hips(20, 0, 110), {22.1981, 3.8035, 27.3623}}}) {
    const JointVec<double> q = arm.joints_rad(tip_mm);
    CHECK(std::abs(q.x / kRadPerDegree - degrees[0]) < 5e-4);
    CHECK(std::abs(q.y / kRadPerDegree - degrees[1]) < 5e-4);
    CHECK(std::abs(q.z / kRadPerDegree - degrees[2]) < 5e-4);
  }
  const auto tip = from_hips(0, 0, 110);
  const auto q = arm.joints_rad(tip);
  CHECK(std::lround((q.x - kerf::falcon::kZeroRad) / kRadPerCount) == -516);
  // Pulling the grip out raises every joint.
  const auto moved = arm.tip_mm(q + JointVec<double>{1, 1, 1} * kRadPerCount) - tip;
  CHECK(moved.z == doctest::Approx(0.046).epsilon(0.01));
  CHECK(std::abs(moved.x) < 1e-9);
  CHECK(std::abs(moved.y) < 1e-9);
}

TEST_CASE("falcon: every leg is as long as it was built, anywhere in the workspace") {
  // The loop in three dimensions: knee, its end piece, shin, the plate's end piece, grip.
  CHECK(rc::check([] {
    const DeviceVec<double> tip = kerf::test::any_in_ball(kerf::falcon::kReachMm);
    const JointVec<double> q = FalconArm{}.joints_rad(tip);
    const std::array<double, 3> angles{q.x, q.y, q.z};
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const double azimuth = kerf::falcon::kLegAzimuthRad[leg];
      const DeviceVec<double> out{std::cos(azimuth), std::sin(azimuth), 0};
      const DeviceVec<double> across{-std::sin(azimuth), std::cos(azimuth), 0};
      const DeviceVec<double> up{0, 0, 1};
      const DeviceVec<double> hip = out * 40.0 + across * -23.09;
      const DeviceVec<double> knee =
          hip + (out * std::cos(angles[leg]) + up * std::sin(angles[leg])) * 60.0;
      const DeviceVec<double> grip = tip + up * kerf::falcon::kOriginDepthMm;
      const DeviceVec<double> plate = grip + out * 14.43 + across * -25.0;
      const DeviceVec<double> span = plate - knee;
      const double sideways = dot(span, across);
      const DeviceVec<double> in_plane = span - across * sideways;
      // Two end pieces of 11.25 mm point along the shin's part in the plane.
      const DeviceVec<double> shin = in_plane * (1 - 22.5 / norm(in_plane)) + across * sideways;
      RC_ASSERT(std::abs(norm(shin) - 102.5) < 1e-9);
      // The knee points outwards of the line from hip to plate.
      RC_ASSERT(dot(knee - hip, out) * dot(plate - hip, up) >
                dot(knee - hip, up) * dot(plate - hip, out));
    }
  }));
}

TEST_CASE("falcon: the end stop keeps the grip in reach and only takes speed outwards") {
  CHECK(rc::check([] {
    const FalconArm arm;
    const DeviceVec<double> before = any_vector(300);
    DeviceVec<double> tip = kerf::test::any_in_ball(1.3 * kerf::falcon::kReachMm);
    const DeviceVec<double> outwards = tip;
    JointVec<double> q = arm.joints_rad(tip);
    auto velocity = before;
    const bool met = arm.stop_at_limits(q, tip, velocity);
    RC_ASSERT(met == !FalconArm::within_limits(outwards));
    RC_ASSERT(norm(tip) < kerf::falcon::kReachMm + 1e-9);
    RC_ASSERT(norm(q - arm.joints_rad(tip)) == 0);
    RC_ASSERT(!met || dot(velocity, outwards) < 1e-6 * (1 + norm(before)));
  }));
}

TEST_CASE("wooden: the tip is where the makers' formula puts it") {
  const WoodenArm arm;
  CHECK(rc::check([&] {
    const auto q = any_joints(arm);
    RC_ASSERT(norm(arm.tip_mm(q) - makers_tip(q)) < 1e-9);
  }));
  CHECK(norm(arm.tip_mm({0, 0, std::numbers::pi / 2}) - DeviceVec<double>{0, 205, 25}) < 1e-9);
  CHECK(arm.tip_mm({0.3, 0.3, 0.7}).x > 0);  // A turns to the right
}

TEST_CASE("wooden: an end stop keeps the arm in its range") {
  const WoodenArm arm;
  JointVec<double> q{0.2, 1.5, 0.3};  // leans too far out, still going
  auto tip = arm.tip_mm(q);
  auto velocity = tip - arm.tip_mm(q - JointVec<double>{0, 0.01, 0});
  const double before = norm(velocity);
  REQUIRE(arm.stop_at_limits(q, tip, velocity));
  CHECK(arm.within_limits({q.x, q.y - 1e-12, q.z}));
  CHECK(q.y == doctest::Approx(1.35));
  CHECK(norm(velocity) < before);
}

}  // namespace kerf::arms_test
