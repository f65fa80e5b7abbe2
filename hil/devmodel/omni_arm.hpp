// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/vec.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf {

/// Link lengths of one arm, mm. The defaults are those of the constants page.
struct OmniLinks {
  double upper_mm = omni::kUpperLinkMm;
  double forearm_mm = omni::kForearmMm;
  double origin_height_mm = omni::kOriginHeightMm;
  double origin_depth_mm = omni::kOriginDepthMm;
};

/// The emulator's kinematics of the Omni: double precision, elbow up, written from the geometry and
/// not from the controller's formulas, so that a sign error on one side cannot hide on the other.
///
/// The arm is two links in a vertical plane that the turret turns about the y axis:
///
///                     elbow               q2  thigh above the horizontal
///                   L1 /\  L2             q3  forearm from straight down, outwards, absolute
///           shoulder  /  \                    (elbow angle = q3 - q2)
///        y |         o    * tip           q1  turret, positive to the left
///          '-- reach ------->
///
/// Any thread, no state besides the lengths. Points out of reach give the nearest elbow angle.
class OmniArm {
 public:
  using Jacobian = Transform<double, DeviceSpace, JointSpace>;

  explicit OmniArm(const OmniLinks& links = {}) noexcept : links_(links) {}

  [[nodiscard]] DeviceVec<double> tip_mm(JointVec<double> q) const noexcept;
  [[nodiscard]] JointVec<double> joints_rad(DeviceVec<double> tip_mm) const noexcept;
  /// d tip / d q, mm per rad. Regular wherever `within_limits` holds.
  [[nodiscard]] Jacobian jacobian(JointVec<double> q) const noexcept;

  /// The force that joint torques exert at a free tip: J^T F = torque.
  [[nodiscard]] DeviceVec<double> tip_force_n(JointVec<double> q,
                                              JointVec<double> torque_nmm) const noexcept;
  /// Joint rates of a tip velocity.
  [[nodiscard]] JointVec<double> joint_rates(JointVec<double> q,
                                             DeviceVec<double> velocity) const noexcept;

  /// The mechanical end stops: turret +-0.98, thigh 0..1.75, elbow -0.81..1.25 rad.
  [[nodiscard]] static bool within_limits(JointVec<double> q) noexcept;

  /// Puts an arm beyond an end stop back onto it and takes away the speed into the stop, so that
  /// the tip never gains energy. Returns whether a stop was met; joints and tip then agree.
  bool stop_at_limits(JointVec<double>& q, DeviceVec<double>& tip_mm,
                      DeviceVec<double>& velocity) const noexcept;

 private:
  OmniLinks links_;
};

}  // namespace kerf
