// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "hil/device/falcon.hpp"
#include "tests/hil/model_runs.hpp"

namespace {

using kerf::ArmPose;
using kerf::DeviceVec;
using kerf::FalconArm;
using kerf::JointVec;
using kerf::falcon::kRadPerCount;
using kerf::falcon::kRadPerDegree;

/// A grip counted from the hips' plane, as the sources do.
DeviceVec<double> from_hips(double x, double y, double z) {
  return {x, y, z - kerf::falcon::kOriginDepthMm};
}

ArmPose pose_at(DeviceVec<double> tip_mm) {
  return {FalconArm{}.joints_rad(tip_mm), tip_mm};
}

DeviceVec<double> any_tip() {
  return kerf::test::any_in_ball(kerf::falcon::kReachMm);
}

}  // namespace

TEST_CASE("the Falcon's joints have the golden angles") {
  struct Golden {
    DeviceVec<double> tip_mm;
    std::array<double, 3> degrees;
  };
  for (const auto& [tip_mm, degrees] :
       {Golden{from_hips(0, 0, 110), {16.188, 16.188, 16.188}},
        Golden{from_hips(20, 0, 110), {22.1981, 3.8035, 27.3623}}}) {
    const JointVec<double> q = FalconArm{}.joints_rad(tip_mm);
    CHECK(std::abs(q.x / kRadPerDegree - degrees[0]) < 5e-4);
    CHECK(std::abs(q.y / kRadPerDegree - degrees[1]) < 5e-4);
    CHECK(std::abs(q.z / kRadPerDegree - degrees[2]) < 5e-4);
  }
  const double counts =
      (FalconArm{}.joints_rad(from_hips(0, 0, 110)).x - kerf::falcon::kZeroRad) / kRadPerCount;
  CHECK(std::lround(counts) == -516);
}

TEST_CASE("every leg of the Falcon is as long as it was built, anywhere in the workspace") {
  // The loop in three dimensions: knee, its end piece, shin, the plate's end piece, grip.
  CHECK(rc::check([] {
    const DeviceVec<double> tip = any_tip();
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

TEST_CASE("Newton's iteration finds the Falcon's grip from its joints") {
  CHECK(rc::check([] {
    const DeviceVec<double> tip = any_tip();
    RC_ASSERT(norm(FalconArm{}.tip_mm(FalconArm{}.joints_rad(tip)) - tip) < 1e-8);
  }));
}

TEST_CASE("the Falcon's joint rates are the derivative of its joints") {
  constexpr double kStep = 1e-5;
  CHECK(rc::check([] {
    const FalconArm arm;
    const DeviceVec<double> tip = any_tip();
    for (const auto& unit : {DeviceVec<double>{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
      const auto slope =
          (arm.joints_rad(tip + unit * kStep) - arm.joints_rad(tip - unit * kStep)) * (0.5 / kStep);
      RC_ASSERT(norm(arm.joint_rates(pose_at(tip), unit) - slope) < 1e-7);
    }
  }));
}

TEST_CASE("torques and force of the Falcon do the same work") {
  CHECK(rc::check([] {
    const FalconArm arm;
    const ArmPose pose = pose_at(any_tip());
    const auto part = [] { return *rc::gen::inRange(-100, 101) * 0.1; };
    const JointVec<double> torque{part(), part(), part()};
    const DeviceVec<double> velocity{part(), part(), part()};
    const double power = dot(torque, arm.joint_rates(pose, velocity));
    RC_ASSERT(std::abs(dot(arm.tip_force_n(pose, torque), velocity) - power) < 1e-9);
  }));
}

TEST_CASE("one count of all legs is 0.046 mm along the Falcon's axis") {
  const FalconArm arm;
  const auto tip = from_hips(0, 0, 110);
  const auto q = arm.joints_rad(tip);
  const auto moved = arm.tip_mm(q + JointVec<double>{1, 1, 1} * kRadPerCount) - tip;
  CHECK(moved.z == doctest::Approx(0.046).epsilon(0.01));
  CHECK(std::abs(moved.x) < 1e-9);
  CHECK(std::abs(moved.y) < 1e-9);
  // Pulling the grip out raises every joint.
  CHECK(moved.z > 0);
}

TEST_CASE("the Falcon's end stop keeps the grip in reach and only takes speed outwards") {
  CHECK(rc::check([] {
    const FalconArm arm;
    const DeviceVec<double> tip = any_tip() * 1.3;
    const auto part = [] { return *rc::gen::inRange(-300, 301) * 1.0; };
    const DeviceVec<double> before{part(), part(), part()};
    ArmPose pose = pose_at(tip);
    auto velocity = before;
    const bool met = arm.stop_at_limits(pose.q, pose.tip_mm, velocity);
    RC_ASSERT(met == !FalconArm::within_limits(tip));
    RC_ASSERT(norm(pose.tip_mm) < kerf::falcon::kReachMm + 1e-9);
    RC_ASSERT(norm(pose.q - arm.joints_rad(pose.tip_mm)) == 0);
    RC_ASSERT(norm(velocity) <= norm(before) * (1 + 1e-12));
    RC_ASSERT(!met || dot(velocity, tip) < 1e-6 * (1 + norm(before)));
    RC_ASSERT(met || velocity == before);
  }));
}
