// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hil/devmodel/arm_math.hpp"
#include "shared/wire/falcon_constants.hpp"

namespace kerf {

/// The emulator's kinematics of the Falcon: double precision, from the loop of each leg.
///
/// With (u, v, w) the grip in the frame of one leg, every pose closes the loop
///
///     (u + c - a cos t)^2 + (w - a sin t)^2 = L^2,   L = d + e + sqrt(b^2 - (v + f)^2).
///
/// Joints from the tip: this is E cos t + F sin t + G = 0, solved by the half angle (Williams, "The
/// delta parallel robot", 2016). Rates and forces: its total differential, so no matrix is ever
/// inverted. The tip from joints is an iteration, for the rest pose of a new model. Any thread, no
/// state.
///
/// The real end stops are unknown: a ball of falcon::kReachMm around the origin stands for them.
/// Inside it all legs reach the grip with a bent knee; outside, the nearest angle is given.
class FalconArm {
 public:
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept;
  /// Newton's iteration from the middle of the workspace.
  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept;

  /// The force that joint torques exert at a free tip.
  [[nodiscard]] DeviceVec<double> tip_force_n(const ArmPose& pose,
                                              JointVec<double> torque_nmm) const noexcept;
  /// Joint rates of a tip velocity.
  [[nodiscard]] JointVec<double> joint_rates(const ArmPose& pose,
                                             DeviceVec<double> velocity) const noexcept;

  [[nodiscard]] static bool within_limits(DeviceVec<double> tip_mm) noexcept {
    return norm(tip_mm) <= falcon::kReachMm;
  }
  /// Puts a tip beyond the end stop back onto it and takes away the speed into the stop. Returns
  /// whether the stop was met; joints and tip then agree.
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept;

 private:
  using Gradients = std::array<DeviceVec<double>, 3>;
  /// Of each joint angle by the tip, rad/mm.
  [[nodiscard]] static Gradients gradients(const ArmPose& pose) noexcept;
};

}  // namespace kerf
