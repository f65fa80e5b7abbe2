// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <kerf/external.h>

// A report as messages of CRTK, and a wrench as a force. Templates over the messages, which need
// the members of geometry_msgs alone, so that this part is tested without ROS. ROS has metres; the
// axes are the scene's: x right, y up, z to the user.

namespace kerf_ros {

constexpr double kMmPerM = 1000;

template <class Vector>
void write(const double (&from)[3], double scale, Vector& to) {
  to.x = scale * from[0];
  to.y = scale * from[1];
  to.z = scale * from[2];
}

/// measured_cp: geometry_msgs/PoseStamped. NaN until the device is calibrated.
template <class Pose>
void write_pose(const kerf_report& now, Pose& out) {
  write(now.position_mm, 1 / kMmPerM, out.pose.position);
  write({now.orientation[0], now.orientation[1], now.orientation[2]}, 1, out.pose.orientation);
  out.pose.orientation.w = now.orientation[3];
}

/// measured_cv: geometry_msgs/TwistStamped, the derivative of measured_cp; no device measures an
/// angular velocity. A report has the velocity at the device port.
template <class Twist>
void write_twist(const kerf_report& now, double workspace_scale, Twist& out) {
  write(now.velocity_mm_per_s, workspace_scale / kMmPerM, out.twist.linear);
}

/// measured_cf: geometry_msgs/WrenchStamped, the force on the hand after all limits, N.
template <class Wrench>
void write_wrench(const kerf_report& now, Wrench& out) {
  write(now.force_n, 1, out.wrench.force);
}

/// servo_cf: the force of a geometry_msgs/WrenchStamped. Its torque counts for nothing: no device
/// has motors for it.
template <class Wrench>
kerf_force force_of(const Wrench& asked) {
  return {{asked.wrench.force.x, asked.wrench.force.y, asked.wrench.force.z}, {}, 0, 0};
}

}  // namespace kerf_ros
