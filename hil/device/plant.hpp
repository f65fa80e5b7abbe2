// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "hil/device/hand_script.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/plant_params.hpp"
#include "shared/numeric/quick_elementary.hpp"
#include "shared/numeric/vec.hpp"

/// The mechanics of all emulated arms: motors with lag and delay, rotors, tip mass, the
/// hand's spring and end stops, in fixed steps and without a clock. `ArmPlant` puts them together.
namespace kerf {

/// One pose of an arm, both ways: joint angles and tip that belong together.
struct ArmPose {
  JointVec<double> q;
  DeviceVec<double> tip_mm;
};

/// Removes the part of `velocity` that drives a stopped angle further, without friction or bounce.
/// `gradient` is the angle's by the tip; `side` is +1 above its range and -1 below.
inline void stop_speed(DeviceVec<double>& velocity, DeviceVec<double> gradient, int side) noexcept {
  const double rate = dot(gradient, velocity);
  if (rate * side > 0) velocity = velocity - gradient * (rate / dot(gradient, gradient));
}

/// The count that an encoder shows: the floor of the angle in counts from its zero, then 16 bits.
[[nodiscard]] inline std::int16_t encoder_count(int at_zero, double counts) noexcept {
  return static_cast<std::int16_t>(
      static_cast<std::uint16_t>(at_zero + static_cast<int>(std::floor(counts))));
}

/// Three linear equations by Cramer's rule. The matrix must be regular.
template <class To, class From>
[[nodiscard]] Vec<double, From> solve(const Transform<double, To, From>& m,
                                      Vec<double, To> rhs) noexcept {
  const auto& a = m.row;
  const auto determinant = [](double a0, double a1, double a2, double b0, double b1, double b2,
                              double c0, double c1, double c2) {
    return a0 * (b1 * c2 - b2 * c1) - a1 * (b0 * c2 - b2 * c0) + a2 * (b0 * c1 - b1 * c0);
  };
  const double whole =
      determinant(a[0][0], a[0][1], a[0][2], a[1][0], a[1][1], a[1][2], a[2][0], a[2][1], a[2][2]);
  return {determinant(rhs.x, a[0][1], a[0][2], rhs.y, a[1][1], a[1][2], rhs.z, a[2][1], a[2][2]) /
              whole,
          determinant(a[0][0], rhs.x, a[0][2], a[1][0], rhs.y, a[1][2], a[2][0], rhs.z, a[2][2]) /
              whole,
          determinant(a[0][0], a[0][1], rhs.x, a[1][0], a[1][1], rhs.y, a[2][0], a[2][1], rhs.z) /
              whole};
}

/// From a command to the torque at the motors: silence of the host, output delay in whole cycles,
/// first-order lag of the current loop. One thread; never allocates.
class MotorChain {
 public:
  explicit MotorChain(const PlantParams& params) noexcept;

  /// Torques that a packet of the host commands, N mm; they act from the next cycle on.
  void command(JointVec<double> torque_nmm) noexcept;
  /// One bus cycle begins.
  void begin_cycle() noexcept;
  /// Torque during the next step of it.
  [[nodiscard]] JointVec<double> step() noexcept {
    torque_nmm_ = applied_nmm_ + (torque_nmm_ - applied_nmm_) * lag_decay_;
    return torque_nmm_;
  }
  /// Returns true if no packet came for so long that the device takes the host for gone.
  [[nodiscard]] bool silent() const noexcept { return cycles_since_command_ > silence_cycles_; }

 private:
  OnSilence on_silence_;
  int silence_cycles_;
  std::size_t delay_;
  double lag_decay_;
  JointVec<double> wanted_nmm_;
  JointVec<double> applied_nmm_;
  JointVec<double> torque_nmm_;
  int cycles_since_command_ = 0;
  std::array<JointVec<double>, kMaxDelayCycles + 1> delayed_nmm_{};
  std::size_t delay_head_ = 0;
};

inline MotorChain::MotorChain(const PlantParams& params) noexcept
    : on_silence_(params.on_silence),
      silence_cycles_(params.silence_cycles),
      delay_(static_cast<std::size_t>(std::clamp(params.output_delay_cycles, 0, kMaxDelayCycles))),
      lag_decay_(params.current_lag_s > 0 ? quick::exponential(-kStepS / params.current_lag_s)
                                          : 0.0) {}

inline void MotorChain::command(JointVec<double> torque_nmm) noexcept {
  wanted_nmm_ = torque_nmm;
  cycles_since_command_ = 0;
}

inline void MotorChain::begin_cycle() noexcept {
  const bool dropped = silent() && on_silence_ == OnSilence::drop_torque;
  delay_head_ = (delay_head_ + 1) % delayed_nmm_.size();
  delayed_nmm_[delay_head_] = dropped ? JointVec<double>{} : wanted_nmm_;
  applied_nmm_ = delayed_nmm_[(delay_head_ + delayed_nmm_.size() - delay_) % delayed_nmm_.size()];
  cycles_since_command_ = std::min(cycles_since_command_ + 1, silence_cycles_ + 1);
}

/// The joints of one moment.
struct JointReadings {
  JointVec<double> encoder_rad;  ///< as the encoders measure them
  JointVec<double> link_rad;
};

/// Input delay of a device: the joints that it reports are some bus cycles old. One thread; never
/// allocates.
class ReportedJoints {
 public:
  ReportedJoints(int delay_cycles, JointVec<double> rest_rad) noexcept
      : delay_(static_cast<std::size_t>(std::clamp(delay_cycles, 0, kMaxDelayCycles))) {
    ring_.fill({rest_rad, rest_rad});
  }

  /// At the end of each cycle.
  void take(const JointReadings& now) noexcept {
    head_ = (head_ + 1) % ring_.size();
    ring_[head_] = now;
  }

  /// The value to report; `now` if there is no delay.
  [[nodiscard]] JointVec<double> delayed_or(JointVec<double> JointReadings::*which,
                                            JointVec<double> now) const noexcept {
    return delay_ == 0 ? now : ring_[(head_ + ring_.size() - delay_) % ring_.size()].*which;
  }

 private:
  std::size_t delay_;
  std::array<JointReadings, kMaxDelayCycles + 1> ring_;
  std::size_t head_ = 0;
};

/// The inertia that turns with the motors, in joint space: none, rigid with the links, or on a
/// spring (a structural mode, which the encoders see from the motor's side).
///
/// Rigid rotors and tip exchange momentum once per step, (m + K' I K) v = m v' + K' I w, with K
/// the joint rates by the tip's velocity and w the rotors' rates before: to first order this holds
/// the forces that come from K changing with the pose, and it never adds energy. One thread.
class Rotors {
 public:
  Rotors(const PlantParams& params, JointVec<double> start_rad) noexcept;

  /// One step: the torque that reaches the links. `link_rates` only matters on springs.
  [[nodiscard]] JointVec<double> drive(JointVec<double> motor_nmm, JointVec<double> link_rad,
                                       JointVec<double> link_rates) noexcept;

  /// Tip velocity after it has exchanged momentum with rigid rotors.
  template <class Arm>
  [[nodiscard]] DeviceVec<double> exchange_momentum(const Arm& arm, const ArmPose& pose,
                                                    double mass_kg,
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

  /// The angles that the encoders measure: of the motors.
  [[nodiscard]] JointVec<double> motor_rad(JointVec<double> link_rad) const noexcept {
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

/// A point mass with viscous and Coulomb friction over one fixed time step.
///
/// Viscous friction is exact for a force that is constant over the step. Coulomb friction takes the
/// speed down by as much as it can in one step and never reverses it, so a mass at rest stays
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
    decay_ = quick::exponential(-exponent);
    gain_ = exponent > 0 ? speed_per_n * -quick::growth(-exponent) / exponent : speed_per_n;
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

/// The observable state of a plant.
struct PlantState {
  ArmPose pose;
  DeviceVec<double> velocity;       ///< of the tip, mm/s
  DeviceVec<double> motor_force_n;  ///< of the motors at the tip, in the latest step
  double motor_work_mj = 0;         ///< of that force on the tip, since the start
  bool at_rest = true;              ///< held in the rest pose: inkwell, stand, calibration pose
};

/// Motors, an arm, its tip and the hand that holds it.
///
/// Per cycle: delay and lag of the motors, delay of the report, then four steps of torque to
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
  /// Joint angles as a report of this moment gives them: of the encoders ...
  [[nodiscard]] JointVec<double> encoder_rad() const noexcept {
    return reported_.delayed_or(&JointReadings::encoder_rad, rotors_.motor_rad(state_.pose.q));
  }
  /// ... and of the links.
  [[nodiscard]] JointVec<double> link_rad() const noexcept {
    return reported_.delayed_or(&JointReadings::link_rad, state_.pose.q);
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
    reported_.take({rotors_.motor_rad(state_.pose.q), state_.pose.q});
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
    velocity = rotors_.exchange_momentum(arm_, middle, mass_kg_, velocity);
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
