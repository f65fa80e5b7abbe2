// SPDX-License-Identifier: Apache-2.0
#include "standin/hd/touch.hpp"

#include <algorithm>

#include "shared/wire/personality.hpp"

namespace kerf::hd {

using standin::Row;

namespace {

constexpr double kVelocityWindowS = 0.01;  // the vendor's filter is not known
constexpr double kNothingN = 1e-9;
constexpr double kCooled = 0.9;  // of the temperature of a warm motor: until then it is one error

/// The pose with all joints at 0.
[[nodiscard]] standin::Pose pose_of_zeros() noexcept {
  constexpr double kHalf =
      0.70710678118654752;  // a stylus along -z: kerf's tool turned by 90 degrees
  standin::Pose pose;
  pose.tip_mm = {0, kShoulderYMm - kLinkMm, kShoulderZMm + kLinkMm};
  pose.orientation = {kHalf, 0, 0, kHalf};
  return pose;
}

}  // namespace

Touch::Touch(const standin::Settings& settings, standin::Device& device, ErrorStack& errors,
             Handle handle, bool is_locked_out)
    : settings_(settings),
      device_(device),
      ledger_(device.ledger),
      errors_(errors),
      handle_(handle),
      serial_("KERF" + std::to_string(device.number)),
      arm_(is_locked_out ? standin::EmulatedArm(settings, device.settings, pose_of_zeros(), ledger_)
                         : standin::EmulatedArm(
                               settings, device.settings, ledger_,
                               [this](standin::Pose& now, double dt_s) { follow(now, dt_s); })),
      rate_hz_(device.settings.rate_hz),
      calibrated_(!settings.uncalibrated) {
  ledger_.add(Row::opened);
}

void Touch::follow(standin::Pose& now, double dt_s) noexcept {
  const Angles joints = joint_angles(now.tip_mm);
  heat_.heat_up(joints, now.applied_n, dt_s);
  if (heat_.hottest() >= 1) is_warm_ = true;
  if (heat_.hottest() < kCooled) is_warm_ = false;
  wrist_.follow(stylus_rotation(now.orientation), joints, dt_s);
  now.orientation = tool_orientation(joints, wrist_.angles());
}

Readings Touch::sampled() const noexcept {
  Readings readings;
  readings.pose = arm_.pose();
  readings.velocity = arm_.velocity(kVelocityWindowS).value_or(DeviceVec<double>{});
  readings.angular_velocity = arm_.angular_velocity(kVelocityWindowS);
  readings.buttons = (readings.pose.button1 ? 1U : 0U) | (readings.pose.button2 ? 2U : 0U);
  readings.joints = joint_angles(readings.pose.tip_mm);
  readings.gimbal = wrist_.angles();
  readings.transform =
      transform_of(wrist_rotation(readings.joints, readings.gimbal), readings.pose.tip_mm);
  return readings;
}

Transform16 Touch::with_scaled_gimbal(const Angles& scale) const noexcept {
  Angles gimbal = now_.gimbal;
  for (std::size_t i = 0; i < 3; ++i) gimbal[i] *= scale[i];
  return transform_of(wrist_rotation(now_.joints, gimbal), now_.pose.tip_mm);
}

void Touch::begin_tick() noexcept {
  had_frame_ = false;
  if (!arm_.lockstep()) arm_.refresh();
  if (!calibrated_ && arm_.pose().parked && runs_) calibrated_ = true;
}

void Touch::begin_frame() noexcept {
  if (in_frame_ || (had_frame_ && one_frame_ && runs_)) {
    ledger_.add(Row::begins_refused);
    return push(kIllegalBegin);
  }
  if (!arm_.lockstep()) arm_.refresh();
  if (arm_.lost()) push(kCommunication);
  if (is_warm_ && !was_warm_) {
    ledger_.add(Row::warm);
    push(kWarmMotors);
  }
  was_warm_ = is_warm_;
  in_frame_ = true;
  before_ = now_;
  now_ = sampled();
  if (!has_two_) before_ = now_;
  has_two_ = true;
  wanted_ = {};
}

void Touch::end_frame() noexcept {
  if (!in_frame_) {
    ledger_.add(Row::ends_refused);
    return push(kIllegalEnd);
  }
  in_frame_ = false;
  had_frame_ = true;
  ledger_.add(Row::frames);
  last_force_n_ = wanted_force();
  const double wanted_n = standin::length_of(last_force_n_);
  arm_.count_command(wanted_n);
  if (!force_output_ && wanted_n > kNothingN) ledger_.add(Row::output_off);
  output_n_ = force_output_ ? limited(last_force_n_) : DeviceVec<double>{};
  if (!runs_) send();
}

DeviceVec<double> Touch::wanted_force() noexcept {
  if (wanted_.has_dac && (wanted_.has_force || wanted_.joint_torque_mnm)) {
    push(kForceError);
    return {};
  }
  const DeviceVec<double> force_n = wanted_.joint_torque_mnm
                                        ? force_of_torques(now_.joints, *wanted_.joint_torque_mnm)
                                        : wanted_.force_n;
  if (all_finite(force_n)) return force_n;
  ledger_.add(Row::not_finite);
  push(kInvalidValue);
  return {};
}

DeviceVec<double> Touch::limited(DeviceVec<double> force_n) noexcept {
  const double length = standin::length_of(force_n);
  const double most_n = force_figures(standin::kHd.personality).peak_n;
  if (norm(now_.velocity) > velocity_limit_) {
    ledger_.add(Row::too_fast);
    push(kExceededVelocity);
    return {};
  }
  if (length > most_n) {
    ledger_.add(Row::excess);
    if (checks_force_) push(kExceededForce);
    if (settings_.cut_excess) return {};
    if (clamps_) force_n = force_n * (most_n / length);
  }
  if (norm(force_n - output_n_) > impulse_limit_n_) {
    ledger_.add(Row::impulses);
    push(kExceededImpulse);
    return {};
  }
  if (!ramps_ || settings_.ramp_s <= 0) return force_n;
  const double since_s = static_cast<double>(ticks_) / rate_hz_;
  return force_n * std::min(1.0, since_s / settings_.ramp_s);
}

void Touch::end_tick() noexcept {
  if (in_frame_) {
    in_frame_ = false;
    ledger_.add(Row::frames_not_ended);
  }
  if (!had_frame_ && settings_.drop_without_frame) output_n_ = {};
  if (arm_.pose().parked) ticks_ = 0;  // it ramps after the dock, too
  ++ticks_;
  has_ticked_ = true;
  send();
}

void Touch::send() noexcept {
  is_forced_ = force_output_ && norm(output_n_) > kNothingN;
  arm_.command(output_n_, force_output_, calibrated_ && runs_);
}

void Touch::run(bool runs, int rate_hz) noexcept {
  // A scheduler without a tick has given no force; one from before it is a matter of `close`.
  if (!runs && runs_ && has_ticked_ && is_forced_) {
    count_not_cleared();
    if (settings_.drop_on_stop) {
      output_n_ = {};
      send();
    }
  }
  if (runs && !runs_) {
    ticks_ = 0;
    has_ticked_ = is_counted_ = false;
  }
  runs_ = runs;
  rate_hz_ = rate_hz;
}

void Touch::count_not_cleared() noexcept {
  if (!is_counted_) ledger_.add(Row::not_cleared);
  is_counted_ = true;
}

void Touch::close() noexcept {
  run(false, rate_hz_);
  if (is_forced_) count_not_cleared();
  arm_.command({}, false, false);
  ledger_.set(Row::last_n, 0);
  ledger_.add(Row::closed);
}

bool* Touch::capability(Enum name) noexcept {
  switch (name) {
    case kForceOutput:
      return &force_output_;
    case kClampForce:
      return &clamps_;
    case kRampForce:
      return &ramps_;
    case kForceLimit:
      return &checks_force_;
    case kOneFrame:
      return &one_frame_;
    default:
      break;
  }
  push(kInvalidEnum);
  return nullptr;
}

void Touch::enable(Enum name, bool on) noexcept {
  if (name == kVelocityLimit || name == kImpulseLimit) {  // capabilities by the same numbers
    double& limit = name == kVelocityLimit ? velocity_limit_ : impulse_limit_n_;
    limit = on ? (name == kVelocityLimit ? 1200 : 4) : HUGE_VAL;
  } else if (bool* which = capability(name)) {
    *which = on;
    if (name != kForceOutput || on) return;
    output_n_ = {};
    is_forced_ = false;  // by the program's word, whenever the next packet leaves
  }
}

bool Touch::is_enabled(Enum name) noexcept {
  if (name == kVelocityLimit) return velocity_limit_ < HUGE_VAL;
  if (name == kImpulseLimit) return impulse_limit_n_ < HUGE_VAL;
  const bool* which = capability(name);
  return which != nullptr && *which;
}

Enum Touch::calibration() noexcept {
  if (!runs_ && !arm_.lockstep()) arm_.refresh();
  return calibrated_ ? kCalibrated : kNeedsHand;
}

void Touch::calibrate() noexcept {
  if (!calibrated_ && arm_.pose().parked && runs_) calibrated_ = true;
}

}  // namespace kerf::hd
