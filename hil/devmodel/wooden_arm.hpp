// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

#include "hil/devmodel/omni_arm.hpp"
#include "shared/wire/wooden_constants.hpp"

namespace kerf {

/// The emulator's kinematics of the WoodenHaptics arm: the Omni's two links with other lengths and
/// other names of the angles (A = -q1, B = pi/2 - q2, C = q3).
///
/// The end stops are ours: turret +-1.0, B -0.35..1.35, and the angle between the links (B + C)
/// 0.45..2.6 rad, which keeps the arm away from its folded and its stretched pose.
class WoodenArm {
 public:
  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept {
    return links_.tip_mm(renamed(q));
  }
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept {
    return renamed(links_.joints_rad(tip_mm));
  }
  [[nodiscard]] DeviceVec<double> tip_force_n(const ArmPose& pose,
                                              JointVec<double> torque_nmm) const noexcept {
    return links_.tip_force_n(renamed(pose.q), turned(torque_nmm));
  }
  [[nodiscard]] JointVec<double> joint_rates(const ArmPose& pose,
                                             DeviceVec<double> velocity) const noexcept {
    return turned(links_.joint_rates(renamed(pose.q), velocity));
  }
  [[nodiscard]] bool within_limits(JointVec<double> q) const noexcept {
    return links_.within_limits(renamed(q));
  }
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept {
    JointVec<double> as_omni = renamed(q);
    if (!links_.stop_at_limits(as_omni, tip_mm, velocity)) return false;
    q = renamed(as_omni);
    return true;
  }

 private:
  static constexpr double kQuarter = std::numbers::pi / 2;
  /// Both ways: the change of names is its own inverse.
  [[nodiscard]] static JointVec<double> renamed(JointVec<double> q) noexcept {
    return {-q.x, kQuarter - q.y, q.z};
  }
  /// The same for torques and rates.
  [[nodiscard]] static JointVec<double> turned(JointVec<double> v) noexcept {
    return {-v.x, -v.y, v.z};
  }

  OmniArm links_{{.upper_mm = wooden::kUpperLinkMm,
                  .forearm_mm = wooden::kForearmMm,
                  .origin_height_mm = wooden::kShoulderHeightMm - wooden::kOriginHeightMm,
                  .origin_depth_mm = wooden::kOriginDepthMm},
                 {.turret_rad = 1.0,
                  .thigh_min_rad = kQuarter - 1.35,
                  .thigh_max_rad = kQuarter + 0.35,
                  .elbow_min_rad = 0.45 - kQuarter,
                  .elbow_max_rad = 2.6 - kQuarter}};
};

}  // namespace kerf
