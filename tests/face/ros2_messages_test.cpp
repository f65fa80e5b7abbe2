// SPDX-License-Identifier: Apache-2.0
// The messages of examples/ros2, with stand-ins for those of geometry_msgs.
#include <doctest/doctest.h>

#include "examples/ros2/messages.hpp"

namespace kerf::ros2_messages_test {
namespace {

struct Vector3 {
  double x = 0, y = 0, z = 0;
};
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};
struct PoseStamped {
  struct {
    Vector3 position;
    Quaternion orientation;
  } pose;
};
struct TwistStamped {
  struct {
    Vector3 linear, angular;
  } twist;
};
struct WrenchStamped {
  struct {
    Vector3 force, torque;
  } wrench;
};

bool same(const Vector3& v, double x, double y, double z) {
  return v.x == doctest::Approx(x) && v.y == doctest::Approx(y) && v.z == doctest::Approx(z);
}

}  // namespace

TEST_CASE("the node for ROS 2 has metres, the derivative of its pose, and the force alone") {
  kerf_report now{};
  const double numbers[]{1, -2, 3, 0.1, 0.2, 0.3, 0.9, 40, 50, -60, 0.5, 0.25, -1};
  for (int i = 0; i < 3; ++i) {
    now.position_mm[i] = numbers[i];
    now.velocity_mm_per_s[i] = numbers[7 + i];
    now.force_n[i] = numbers[10 + i];
  }
  for (int i = 0; i < 4; ++i) now.orientation[i] = numbers[3 + i];
  PoseStamped pose;
  kerf_ros::write_pose(now, pose);
  CHECK(same(pose.pose.position, 0.001, -0.002, 0.003));
  CHECK(pose.pose.orientation.x == 0.1);
  CHECK(pose.pose.orientation.y == 0.2);
  CHECK(pose.pose.orientation.z == 0.3);
  CHECK(pose.pose.orientation.w == 0.9);
  TwistStamped twist;
  kerf_ros::write_twist(now, 2, twist);  // the scene is twice as large as the device's workspace
  CHECK(same(twist.twist.linear, 0.08, 0.1, -0.12));
  CHECK(same(twist.twist.angular, 0, 0, 0));
  WrenchStamped wrench;
  kerf_ros::write_wrench(now, wrench);
  CHECK(same(wrench.wrench.force, 0.5, 0.25, -1));
  wrench.wrench.torque = {7, 7, 7};
  const kerf_force force = kerf_ros::force_of(wrench);
  CHECK(same({force.force_n[0], force.force_n[1], force.force_n[2]}, 0.5, 0.25, -1));
  CHECK(force.stiffness_n_per_mm == 0);
  CHECK(force.damping_ns_per_mm == 0);
}

}  // namespace kerf::ros2_messages_test
