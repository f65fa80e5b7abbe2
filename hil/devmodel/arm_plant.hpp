// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "hil/devmodel/arm_math.hpp"
#include "hil/devmodel/bus_cycle.hpp"
#include "hil/devmodel/hand_script.hpp"
#include "hil/devmodel/motor_chain.hpp"
#include "hil/devmodel/plant_params.hpp"
#include "hil/devmodel/reported_joints.hpp"
#include "hil/devmodel/rotors.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// A point mass with viscous and Coulomb friction over one fixed time step.
///
/// Viscous friction is exact for a force that is constant over the step. Coulomb friction takes the
/// speed down by what it can take in one step and never turns it round, so a mass at rest stays
/// exactly at rest below the limit, and the terminal speed is (F - Fc) / b (the stick band of
/// Karnopp's model, with the width that follows from the step). Kick between two half drifts, and
/// the motion is of second order and keeps energy.
class TipMass {
 public:
  /// Mass in kg (> 0), viscous friction in N s/mm, Coulomb friction in N, step in s.
  TipMass(double mass_kg, double viscous_ns_per_mm, double coulomb_n, double step_s) noexcept {
    constexpr double kMmPerM = 1000.0;
    const double speed_per_n = kMmPerM * step_s / mass_kg;
    const double exponent = viscous_ns_per_mm * speed_per_n;
    decay_ = std::exp(-exponent);
    gain_ = exponent > 0 ? speed_per_n * -std::expm1(-exponent) / exponent : speed_per_n;
    coulomb_drop_ = coulomb_n * gain_;
  }

  /// Velocity in mm/s after one step under `force_n`.
  [[nodiscard]] DeviceVec<double> kick(DeviceVec<double> velocity,
                                       DeviceVec<double> force_n) const noexcept {
    const DeviceVec<double> pushed = velocity * decay_ + force_n * gain_;
    const double speed = norm(pushed);
    if (speed <= coulomb_drop_) return {};
    return pushed * (1.0 - coulomb_drop_ / speed);
  }

 private:
  double decay_ = 1;
  double gain_ = 0;          ///< mm/s per N
  double coulomb_drop_ = 0;  ///< mm/s
};

/// What a plant shows of itself.
struct PlantState {
  ArmPose pose;
  DeviceVec<double> velocity;       ///< of the tip, mm/s
  DeviceVec<double> motor_force_n;  ///< of the motors at the tip, in the latest step
  double motor_work_mj = 0;         ///< of that force on the tip, since the start
  bool at_rest = true;              ///< held in the rest pose: inkwell, stand, calibration pose
};

/// The mechanics that all devices share: motors, an arm, its tip and the hand that holds it, in
/// fixed steps and without a clock.
///
/// Per cycle: delay and lag of the motors (and of what is reported), then four steps of torque to
/// tip force, mass, friction, hand spring and end stops. Weight counts as balanced. `Arm` knows its
/// geometry: `tip_mm`, `joints_rad`, `tip_force_n` (J^-T torque), `joint_rates` (J^-1 velocity),
/// `stop_at_limits`. One thread; never allocates; the same calls give the same numbers, bit for bit
/// on one machine.
template <class Arm>
class ArmPlant {
 public:
  ArmPlant(const Arm& arm, const PlantParams& params, JointVec<double> rest_rad) noexcept
      : arm_(arm),
        motors_(params),
        mass_kg_(params.tip_mass_kg + params.hand_mass_kg),
        mass_(mass_kg_, params.viscous_ns_per_mm + params.hand_damping_ns_per_mm, params.coulomb_n,
              kStepS),
        hand_stiffness_(params.hand_stiffness_n_per_mm),
        hand_damping_(params.hand_damping_ns_per_mm),
        rotors_(params, rest_rad),
        reported_(params.input_delay_cycles, rest_rad),
        rest_{rest_rad, arm.tip_mm(rest_rad)},
        target_mm_(rest_.tip_mm) {
    state_.pose = rest_;
  }

  [[nodiscard]] MotorChain& motors() noexcept { return motors_; }
  [[nodiscard]] const MotorChain& motors() const noexcept { return motors_; }
  [[nodiscard]] const Arm& arm() const noexcept { return arm_; }
  [[nodiscard]] const PlantState& state() const noexcept { return state_; }
  [[nodiscard]] const ArmPose& rest() const noexcept { return rest_; }
  /// Joint angles as a report of this moment tells them: by the encoders ...
  [[nodiscard]] JointVec<double> encoder_rad() const noexcept {
    return reported_.old_or(&JointReadings::encoder_rad, rotors_.seen_rad(state_.pose.q));
  }
  /// ... and of the links.
  [[nodiscard]] JointVec<double> link_rad() const noexcept {
    return reported_.old_or(&JointReadings::link_rad, state_.pose.q);
  }

  /// One bus cycle.
  void cycle(const HandGoal& hand) noexcept {
    motors_.begin_cycle();
    const DeviceVec<double> goal = hand.in_inkwell ? rest_.tip_mm : hand.target_mm;
    const DeviceVec<double> goal_velocity = (goal - target_mm_) * (1.0 / kCycleS);
    for (int i = 0; i < kStepsPerCycle; ++i) {
      const JointVec<double> torque_nmm = motors_.step();
      constexpr double kCatchMm = 2.0;  // the rest pose catches a tip that comes this close
      state_.at_rest =
          hand.in_inkwell && (state_.at_rest || norm(state_.pose.tip_mm - rest_.tip_mm) < kCatchMm);
      if (state_.at_rest) {
        rest(torque_nmm);
      } else {
        move(torque_nmm, target_mm_ + goal_velocity * ((i + 0.5) * kStepS), goal_velocity);
      }
    }
    target_mm_ = goal;
    reported_.take({rotors_.seen_rad(state_.pose.q), state_.pose.q});
  }

 private:
  void rest(JointVec<double> torque_nmm) noexcept {
    state_.pose = rest_;
    state_.velocity = {};
    rotors_.follow(arm_, rest_, {});
    state_.motor_force_n = arm_.tip_force_n(rest_, rotors_.drive(torque_nmm, rest_.q, {}));
  }

  void move(JointVec<double> torque_nmm, DeviceVec<double> target_mm,
            DeviceVec<double> target_velocity) noexcept {
    DeviceVec<double>& tip_mm = state_.pose.tip_mm;
    DeviceVec<double>& velocity = state_.velocity;
    const DeviceVec<double> from_mm = tip_mm;
    tip_mm = tip_mm + velocity * (kStepS / 2);
    const ArmPose middle{arm_.joints_rad(tip_mm), tip_mm};
    const JointVec<double> link_rates =
        rotors_.flexible() ? arm_.joint_rates(middle, velocity) : JointVec<double>{};
    state_.motor_force_n =
        arm_.tip_force_n(middle, rotors_.drive(torque_nmm, middle.q, link_rates));
    // The damper pulls towards the target's velocity; its part on the tip's own is in the mass.
    const DeviceVec<double> hand_n =
        (target_mm - tip_mm) * hand_stiffness_ + target_velocity * hand_damping_;
    velocity = mass_.kick(velocity, state_.motor_force_n + hand_n);
    velocity = rotors_.share(arm_, middle, mass_kg_, velocity);
    tip_mm = tip_mm + velocity * (kStepS / 2);
    state_.motor_work_mj += dot(state_.motor_force_n, tip_mm - from_mm);
    state_.pose.q = arm_.joints_rad(tip_mm);
    arm_.stop_at_limits(state_.pose.q, tip_mm, velocity);
    rotors_.follow(arm_, middle, velocity);
  }

  Arm arm_;
  MotorChain motors_;
  double mass_kg_;
  TipMass mass_;
  double hand_stiffness_;  ///< N/mm
  double hand_damping_;    ///< N s/mm
  Rotors rotors_;
  ReportedJoints reported_;
  ArmPose rest_;
  DeviceVec<double> target_mm_;
  PlantState state_;
};

}  // namespace kerf
