// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hil/devmodel/arm_math.hpp"
#include "hil/devmodel/plant_params.hpp"

namespace kerf {

/// The inertia that turns with the motors, in joint space: none, rigid with the links, or on a
/// spring (a structural mode, which the encoders see from the motor's side).
///
/// Rigid rotors and tip share their momentum once per step, (m + K' I K) v = m v' + K' I w, with K
/// the joint rates by the tip's velocity and w the rotors' rates before: to first order this holds
/// the forces that come from K changing with the pose, and it never adds energy. One thread.
class Rotors {
 public:
  Rotors(const PlantParams& params, JointVec<double> start_rad) noexcept;

  /// One step: the torque that reaches the links. `link_rates` only matters on springs.
  [[nodiscard]] JointVec<double> drive(JointVec<double> motor_nmm, JointVec<double> link_rad,
                                       JointVec<double> link_rates) noexcept;

  /// Tip velocity after rigid rotors have taken their share of the momentum.
  template <class Arm>
  [[nodiscard]] DeviceVec<double> share(const Arm& arm, const ArmPose& pose, double mass_kg,
                                        DeviceVec<double> velocity) const noexcept {
    if (!rigid()) return velocity;
    Transform<double, DeviceSpace, DeviceSpace> mass;
    const auto column = [&](DeviceVec<double> unit) {
      return unit * mass_kg + arm.tip_force_n(pose, momentum_of(arm.joint_rates(pose, unit)));
    };
    const auto x = column({1, 0, 0}), y = column({0, 1, 0}), z = column({0, 0, 1});
    mass.row = {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
    return solve(mass, velocity * mass_kg + arm.tip_force_n(pose, momentum_of(rates_)));
  }
  /// The velocity with which the tip came out of the step.
  template <class Arm>
  void follow(const Arm& arm, const ArmPose& pose, DeviceVec<double> velocity) noexcept {
    if (rigid()) rates_ = arm.joint_rates(pose, velocity);
  }

  /// What the encoders see of these joint angles.
  [[nodiscard]] JointVec<double> seen_rad(JointVec<double> link_rad) const noexcept {
    return flexible() ? angle_rad_ : link_rad;
  }
  [[nodiscard]] bool flexible() const noexcept { return angular_hz_ > 0; }

 private:
  [[nodiscard]] bool rigid() const noexcept { return heavy_ && !flexible(); }
  /// Scaled so that J^-T, which takes N mm to N, gives kg mm/s.
  [[nodiscard]] JointVec<double> momentum_of(JointVec<double> rates) const noexcept;

  JointVec<double> inertia_kg_m2_;
  bool heavy_;
  double angular_hz_;  ///< rad/s of the mode; 0 = rigid
  double damping_ratio_;
  JointVec<double> angle_rad_;
  JointVec<double> rates_;
};

}  // namespace kerf
