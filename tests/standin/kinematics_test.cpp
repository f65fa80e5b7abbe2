// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstddef>

#include <doctest/doctest.h>

#include "standin/dhd/numbers.hpp"
#include "standin/hd/touch_kinematics.hpp"

namespace kerf::kinematics_test {

using namespace kerf::hd;  // NOLINT(google-build-using-namespace)

namespace {

constexpr double kTiny = 1e-9;

/// The tip for joint angles, by the formula of the vendor's configuration.
DeviceVec<double> tip_mm(const Angles& q) {
  const double r = kLinkMm * (std::cos(q[1]) + std::sin(q[2]));
  return {-std::sin(q[0]) * r, kLinkMm * (std::sin(q[1]) - std::cos(q[2])) + kShoulderYMm,
          std::cos(q[0]) * r + kShoulderZMm};
}

bool near(DeviceVec<double> a, DeviceVec<double> b, double tolerance) {
  return norm(a - b) < tolerance;
}

}  // namespace

TEST_CASE("all joints at 0 is the pose that the vendor's configuration names") {
  const Angles zero = joint_angles({0, -110, -35});
  for (const double angle : zero) CHECK(std::abs(angle) < 1e-6);
  CHECK(near(tip_mm({0, 0, 0}), {0, -110, -35}, kTiny));
}

TEST_CASE("joint angles lead back to their position, the turret to the left") {
  for (const DeviceVec<double> p :
       {DeviceVec<double>{0, 0, 0}, DeviceVec<double>{60, 30, -20}, DeviceVec<double>{-90, -40, 40},
        DeviceVec<double>{0, 90, 50}}) {
    CHECK(near(tip_mm(joint_angles(p)), p, 1e-6));
    if (p.x != 0) CHECK((joint_angles(p)[0] > 0) == (p.x < 0));
  }
}

TEST_CASE("an upright tool has the stylus axis of HD upwards, and its tip below the gimbal") {
  const Matrix3 r = stylus_rotation({0, 0, 0, 1});
  // The axis of the stylus is the third column; the tip lies along its negative.
  CHECK(std::abs(r[0][2]) < kTiny);
  CHECK(std::abs(r[1][2] - 1) < kTiny);
  CHECK(std::abs(r[2][2]) < kTiny);
  // Turned by 90 degrees about x, the handle points to the user.
  const double half = std::sqrt(0.5);
  const Matrix3 turned = stylus_rotation({half, 0, 0, half});
  CHECK(std::abs(turned[2][2] - 1) < kTiny);
  CHECK(std::abs(turned[0][0] - 1) < kTiny);
}

TEST_CASE("joint torques do the work of their force") {
  const DeviceVec<double> p{30, 20, 10};
  const Angles joints = joint_angles(p);
  const Angles torque_mnm{40, -25, 15};
  const DeviceVec<double> force_n = force_of_torques(joints, torque_mnm);
  constexpr double kStep = 1e-6;
  for (std::size_t i = 0; i < 3; ++i) {
    Angles moved = joints;
    moved[i] += kStep;
    const double work = dot(force_n, tip_mm(moved) - tip_mm(joints)) / kStep;
    CHECK(std::abs(work - torque_mnm[i]) < 1e-3);
  }
}

TEST_CASE("the axes of dhd are those of two clients: x to the user, y right, z up") {
  const auto user = kerf::dhd::from_dhd(1, 0, 0), right = kerf::dhd::from_dhd(0, 1, 0),
             up = kerf::dhd::from_dhd(0, 0, 1);
  CHECK(user == DeviceVec<double>{0, 0, 1});
  CHECK(right == DeviceVec<double>{1, 0, 0});
  CHECK(up == DeviceVec<double>{0, 1, 0});
  CHECK(kerf::dhd::to_dhd({1, 2, 3}) == std::array<double, 3>{3, 1, 2});
}

}  // namespace kerf::kinematics_test
