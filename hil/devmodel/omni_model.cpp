// SPDX-License-Identifier: Apache-2.0
#include "hil/devmodel/omni_model.hpp"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

constexpr int kStepsPerCycle = 4;  // 31 us: far below the fastest spring-mass period here
constexpr double kCycleS = 1.0 / omni::kBusCyclesPerSecond;
constexpr double kStepS = kCycleS / kStepsPerCycle;
constexpr double kInkwellMm = 2.0;  // the inkwell catches a stylus that comes this close

/// Counts of one encoder: the floor of the angle, then 16 bits.
std::int16_t encoder_count(int offset, int sign, double angle_rad) noexcept {
  const double counts = std::floor(sign * angle_rad / omni::kRadPerCount);
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(offset + static_cast<int>(counts)));
}

/// Wiper A of a gimbal angle; wiper B is the rest to 2^16. Angles beyond the pot stay at its end.
constexpr int kPotTurn = 1 << 16;
int wiper_count(std::size_t axis, double angle_rad) noexcept {
  const double ratio = (angle_rad - omni::kGimbalOffsetRad[axis]) / omni::kGimbalSlopeRad[axis];
  return std::clamp(static_cast<int>(std::floor(ratio * kPotTurn + 0.5)), 1, kPotTurn - 1);
}

}  // namespace

OmniModel::OmniModel(const OmniParams& params)
    : params_(params),
      arm_(params.links),
      mass_(params.tip_mass_kg + params.hand_mass_kg,
            params.viscous_ns_per_mm + params.hand_damping_ns_per_mm, params.coulomb_n, kStepS),
      dock_rad_{params.dock_rad[0], params.dock_rad[1], params.dock_rad[2]},
      dock_tip_mm_(arm_.tip_mm(dock_rad_)),
      lag_decay_(params.current_lag_s > 0 ? std::exp(-kStepS / params.current_lag_s) : 0.0),
      joints_rad_(dock_rad_),
      tip_mm_(dock_tip_mm_),
      target_mm_(dock_tip_mm_),
      noise_(params.seed) {
  params_.output_delay_cycles = std::clamp(params.output_delay_cycles, 0, kMaxOutputDelayCycles);
}

void OmniModel::command(const OmniCommand& command) noexcept {
  command_ = command;
  cycles_since_command_ = 0;
}

JointVec<double> OmniModel::wanted_torque() const noexcept {
  const bool silent = cycles_since_command_ > params_.silence_cycles;
  if (!command_.motors_on || (silent && params_.on_silence == OnSilence::drop_torque)) return {};
  const auto torque = [&](std::size_t i) {
    return command_.motor[i] * params_.torque_nmm_per_count[i];
  };
  return {torque(0), torque(1), torque(2)};
}

void OmniModel::step(const HandGoal& hand) noexcept {
  delay_head_ = (delay_head_ + 1) % delayed_nmm_.size();
  delayed_nmm_[delay_head_] = wanted_torque();
  const auto delay = static_cast<std::size_t>(params_.output_delay_cycles);
  const JointVec<double> applied =
      delayed_nmm_[(delay_head_ + delayed_nmm_.size() - delay) % delayed_nmm_.size()];
  cycles_since_command_ = std::min(cycles_since_command_ + 1, params_.silence_cycles + 1);

  orientation_rad_ = hand.orientation_rad;
  button1_ = hand.button1;
  button2_ = hand.button2;

  const DeviceVec<double> goal = hand.in_inkwell ? dock_tip_mm_ : hand.target_mm;
  const DeviceVec<double> goal_velocity = (goal - target_mm_) * (1.0 / kCycleS);
  for (int i = 0; i < kStepsPerCycle; ++i) {
    torque_nmm_ = applied + (torque_nmm_ - applied) * lag_decay_;
    move_tip(hand, target_mm_ + goal_velocity * ((i + 0.5) * kStepS), goal_velocity);
  }
  target_mm_ = goal;
}

void OmniModel::move_tip(const HandGoal& hand, DeviceVec<double> target_mm,
                         DeviceVec<double> target_velocity) noexcept {
  docked_ = hand.in_inkwell && (docked_ || norm(tip_mm_ - dock_tip_mm_) < kInkwellMm);
  if (docked_) {
    joints_rad_ = dock_rad_;
    tip_mm_ = dock_tip_mm_;
    velocity_ = {};
    motor_force_n_ = arm_.tip_force_n(dock_rad_, torque_nmm_);
    return;
  }
  tip_mm_ = tip_mm_ + velocity_ * (kStepS / 2);
  motor_force_n_ = arm_.tip_force_n(arm_.joints_rad(tip_mm_), torque_nmm_);
  // The damper pulls towards the target's velocity; its part on the tip's own is in the mass.
  const DeviceVec<double> hand_n = (target_mm - tip_mm_) * params_.hand_stiffness_n_per_mm +
                                   target_velocity * params_.hand_damping_ns_per_mm;
  velocity_ = mass_.kick(velocity_, motor_force_n_ + hand_n);
  tip_mm_ = tip_mm_ + velocity_ * (kStepS / 2);
  joints_rad_ = arm_.joints_rad(tip_mm_);
  arm_.stop_at_limits(joints_rad_, tip_mm_, velocity_);
}

std::uint16_t OmniModel::noisy(std::uint16_t pot) noexcept {
  if (!params_.pot_noise) return pot;
  constexpr std::uint32_t kNoiseMask = (1u << omni::kPotNoiseBits) - 1;
  return static_cast<std::uint16_t>((pot & ~kNoiseMask) | (noise_() & kNoiseMask));
}

OmniReport OmniModel::next_report() noexcept {
  const JointVec<double>& q = joints_rad_;
  const std::array<double, 3> turned{q.x - dock_rad_.x, q.y - dock_rad_.y, q.z - dock_rad_.z};
  const std::array<double, 3> gimbal{orientation_rad_[0], q.z + orientation_rad_[1],
                                     orientation_rad_[2]};
  OmniReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    report.encoder[i] = encoder_count(params_.encoder_offset[i], omni::kEncoderSign[i], turned[i]);
    const int wiper = wiper_count(i, gimbal[i]);
    report.pot_a[i] = noisy(static_cast<std::uint16_t>(wiper));
    report.pot_b[i] = noisy(static_cast<std::uint16_t>(kPotTurn - wiper));
  }
  report.button1 = button1_;
  report.button2 = button2_;
  report.docked = docked_;
  report.counter = ++packets_;
  return report;
}

}  // namespace kerf
