// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/contract.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

#include "controller/servo/servo.hpp"

namespace kerf::faults {
namespace {

// The contract: docs/safety.md.
constexpr double kHoldMs = 5, kZeroMs = 20, kFadeInMs = 100, kOffMs = 2, kRestMs = 50;
constexpr double kNotFiniteMs = 2;    // from the first tick without a finite pose
constexpr double kStandstillMs = 20;  // a host that came back after that
constexpr double kWatchdogMs = 25;
constexpr double kThermalTimeMs = 10'000;
constexpr double kStillMs = 3000;   // no reading changes while the motors push
constexpr double kAnewTicks = 160;  // without a newer number: the device counts anew
constexpr double kSparseMs = 40, kSparseForgiven = 1.0 / 20;
constexpr double kReportMs = 1;  // from one report to the next, of the slowest device
constexpr double kCycleMs = 0.125;
// A step of the converters is 0.4 to 5 mN at the tip, and the watch is on the outside of them.
constexpr double kStepN = 0.01;
constexpr double kDeviceShare = 1.03;  // the tip moves on while a command is under way
constexpr double kSpeedShare = 1.02;   // encoders count whole steps: surely too fast from here on
constexpr double kSpeedStepMm = 0.2;
constexpr double kPushN = 0.05;
// A force may have turned about as fast as it may rise; longer inward is no slew.
constexpr double kTurnMs = 20;
constexpr double kJumpMm = 1;  // from one report to the next: no hand does so
constexpr std::size_t kMaxListed = 4;

/// From the start of a fault at the device until the motors must be off for `name`. A fault that
/// the servo bears for a while begins for it with the report that first shows it, or is missing.
double latest_latch_ms(const std::string& name, double tick_ms) {
  const bool by_silence =
      name == fault_name(Fault::stale_input) || name == fault_name(Fault::sparse_input);
  if (by_silence) return kZeroMs + kReportMs + tick_ms;
  if (name == fault_name(Fault::not_finite)) return kNotFiniteMs + kReportMs + tick_ms;
  return kReportMs + tick_ms;
}

/// Returns true if an arm that reported `before` and reports `now` rests.
bool is_near(const EncoderCounts& now, const EncoderCounts& before, int rest_counts) {
  return std::ranges::equal(now, before, [&](std::int16_t a, std::int16_t b) {
    const auto step = static_cast<std::int16_t>(static_cast<std::uint16_t>(int{a} - int{b}));
    return std::abs(int{step}) <= rest_counts;
  });
}

/// How far `force` is from any part of `last` along its own direction, from none to all of it.
double change_but_for_fall_n(DeviceVec<double> last, DeviceVec<double> force) {
  const double square = dot(last, last);
  const double share = square > 0 ? std::clamp(dot(force, last) / square, 0.0, 1.0) : 0.0;
  return norm(force - last * share);
}

}  // namespace

SafetyMonitor::SafetyMonitor(const LoadedScene& scene, bool trusted, FaultOutcome& outcome)
    : limits_(scene.limits),
      tick_ms_(1000.0 / scene.servo.rate_hz),
      trusted_(trusted),
      outcome_(outcome),
      wire_(scene.device.personality, scene.device.dock_rad),
      outward_(scene) {
  if (scene.force.model == ForceModel::external) program_stale_ms_ = scene.force.stale_ms;
}

void SafetyMonitor::fault_begins(double time_ms) noexcept {
  if (outcome_.latched == fault_name(Fault::none)) begun_ms_ = time_ms;
}

void SafetyMonitor::service_fails(double time_ms) noexcept {
  if (service_failed_ms_ < 0) service_failed_ms_ = time_ms;
}

void SafetyMonitor::check(bool kept, double time_ms, const char* rule, double value, double limit) {
  if (kept) return;
  char line[128];
  std::snprintf(line, sizeof line, "%s: %.3f, limit %.3f", rule, value, limit);
  broken(time_ms, line);
}

void SafetyMonitor::broken(double time_ms, const std::string& what) {
  ++outcome_.violation_count;
  if (outcome_.violations.size() >= kMaxListed) return;
  char time[24];
  std::snprintf(time, sizeof time, "%.4f s: ", time_ms / 1000);
  outcome_.violations.emplace_back(time + what);
}

void SafetyMonitor::reported(double time_ms, std::span<const std::uint8_t> packet) {
  // At 8 kHz these ticks are the 20 ms after which the silence is a fault: that comes first.
  const double anew_ms = std::max((kAnewTicks + 0.5) * tick_ms_, kZeroMs + 1.5 * tick_ms_);
  const auto told = wire_.report(packet, time_ms - heard_ms_ > anew_ms);
  if (!told) return;
  told_ = *told;
  fresh_ = true;
  heard_ms_ = time_ms;
}

/// Parked, homed and no joint turning for 50 ms: calibrated, whatever was before. Counters that get
/// their zero there may not creep away meanwhile.
void SafetyMonitor::follow_rest(double time_ms) {
  const bool still =
      told_.parked && told_.homed && is_near(told_.count, rest_count_, wire_.rest_counts());
  if (!still || !wire_.counts_from_rest()) rest_count_ = told_.count;
  // Whole ticks at both ends, and the first report may be one of its periods old.
  const double tolerance_ms = 2 * std::max(tick_ms_, kReportMs);
  const bool goes_on = still && time_ms - told_at_ms_ < tolerance_ms;
  told_at_ms_ = time_ms;
  if (!still) rest_since_ms_ = -1;
  if (still && rest_since_ms_ < 0) rest_since_ms_ = time_ms;
  if (!goes_on) rest_without_gap_since_ms_ = time_ms;
  const bool may_have_rested = still && time_ms - rest_since_ms_ >= kRestMs - tolerance_ms;
  if (!may_have_rested) return;
  const bool has_rested = time_ms - rest_without_gap_since_ms_ >= kRestMs + tolerance_ms;
  if (wire_.has_dock() && dock_ && wire_.turned_rad(*dock_, told_.count) > wire_.dock_play()) {
    // No dock: it calibrates nothing, and forgives nothing.
    if (has_rested) must_stay_off(fault_name(Fault::wrong_dock));
    return;
  }
  if (has_rested && !dock_) dock_ = told_.count;
  sparse_ms_ = 0;
  calibrated_again_ = calibrated_again_ || outcome_.pushed;
  calibrated_ = true;
  if (!wire_.counts_from_rest()) return;
  zero_is_known_ = has_rested || is_near(told_.count, wire_.dock_count(), wire_.rest_counts());
  zero_is_true_ = docked_;
  if (has_rested) wire_.calibrated_at(told_.count);
}

void SafetyMonitor::must_stay_off(const char* fault) {
  off_ = Off::fault;
  calibrated_ = false;
  if (outcome_.latched == fault_name(Fault::none)) outcome_.latched = fault;
}

/// What the newest report means for the motors.
void SafetyMonitor::follow_report(double time_ms) {
  follow_rest(time_ms);
  const auto told_pose = wire_.pose(told_.count);
  const std::optional<ArmPose> before = pose_;
  const double since_ms = time_ms - pose_ms_;
  moved_mm_ = {};
  if (told_pose) {
    if (before) moved_mm_ = told_pose->tip_mm - before->tip_mm;
    // A jump is over where the tip is near that place again, by a jump back too, or is free.
    const double near_mm = std::max(kJumpMm, norm(moved_mm_) / 2);
    if (jumped_from_mm_ && (norm(told_pose->tip_mm - *jumped_from_mm_) < near_mm ||
                            outward_.is_free(told_pose->tip_mm))) {
      jumped_from_mm_.reset();
    } else if (!jumped_from_mm_ && norm(moved_mm_) > kJumpMm) {
      jumped_from_mm_ = before->tip_mm;
    }
    pose_ = told_pose;
    pose_ms_ = time_ms;
    if (norm(moved_mm_) > outward_.reach_mm()) {
      way_in_is_known_ = false;
    } else if (!way_in_is_known_ && norm(last_.force_n) <= kPushN) {
      way_in_is_known_ = outward_.is_free(pose_->tip_mm);
    }
    no_pose_since_ms_ = -1;
  } else if (no_pose_since_ms_ < 0) {
    no_pose_since_ms_ = time_ms;
    had_no_pose_ = had_no_pose_ || off_ == Off::no_reason;
  }
  if (!told_.homed) {
    off_ = Off::not_homed;
    calibrated_ = false;
    return;
  }
  if (told_.parked) {
    if (calibrated_ || off_ == Off::no_reason) off_ = Off::parked;
    return;
  }
  if (off_ == Off::parked) {
    off_ = Off::no_reason;
    calibrated_ = false;
    may_push_since_ms_ = time_ms;
  }
  if (off_ != Off::no_reason) return;
  if (before && told_pose && zero_is_known_) {
    const double most_mm = limits_.speed_mm_per_s / 1000 * since_ms;
    if (norm(moved_mm_) > most_mm * kSpeedShare + kSpeedStepMm) {
      must_stay_off(fault_name(Fault::overspeed));
    }
  }
}

/// No report came in this tick, or none with a pose.
void SafetyMonitor::follow_silence(double time_ms) {
  if (off_ != Off::no_reason) return;
  constexpr double kRounding = 1e-6;
  if (link_ended_ || listened_ms_ - heard_ms_ > kZeroMs + kRounding) {
    must_stay_off(fault_name(Fault::stale_input));
  } else if (no_pose_since_ms_ >= 0 &&
             time_ms - no_pose_since_ms_ > kNotFiniteMs + tick_ms_ + kRounding) {
    must_stay_off(fault_name(Fault::not_finite));
  }
}

/// Readings that stand still under torque are no news, and a device without numbers may repeat
/// them.
void SafetyMonitor::follow_stillness(double time_ms) {
  if (wire_.numbers_its_packets()) return;
  const double still_ms = time_ms - still_since_ms_;
  const bool changed = !(told_ == still_);
  stands_still_ = !changed && still_ms > kStillMs;
  if (changed || (!last_.asked.has_torque() && still_ms <= kStillMs)) {
    still_ = told_;
    still_since_ms_ = time_ms;
  } else if (off_ == Off::no_reason) {
    if (still_ms > kStillMs && still_ms <= kStillMs + tick_ms_) fault_begins(time_ms);
    if (still_ms > kStillMs + kZeroMs + 2 * tick_ms_) must_stay_off(fault_name(Fault::stale_input));
  }
}

/// Reports that come again and again just before the force is zero.
void SafetyMonitor::follow_sparse(double time_ms) {
  if (off_ != Off::no_reason) return;
  const double tick_ms = std::min(time_ms - last_.time_ms, tick_ms_);
  const bool falls = listened_ms_ - heard_ms_ > kHoldMs;
  sparse_ms_ = falls ? sparse_ms_ + tick_ms : std::max(0.0, sparse_ms_ - tick_ms * kSparseForgiven);
  if (sparse_ms_ > kSparseMs + 2 * tick_ms_) must_stay_off(fault_name(Fault::sparse_input));
}

/// A host that was silent for 20 ms begins at zero and fades in again; the packet that ends the
/// silence may be the watchdog's packet, and then the next one is the host's own.
void SafetyMonitor::follow_stall(const TimedCommand& command) {
  const bool stalled = command.time_ms - last_.time_ms >= kStandstillMs;
  begins_anew_ = stalled || after_stall_;
  if (begins_anew_) may_push_since_ms_ = std::max(may_push_since_ms_, command.time_ms);
  after_stall_ = stalled && command.asked.off();
}

void SafetyMonitor::commanded(double time_ms, std::span<const std::uint8_t> packet) {
  const auto asked = wire_.command(packet);
  if (!asked) return broken(time_ms, "a packet that the device cannot read");
  if (fresh_) follow_report(time_ms);
  follow_silence(time_ms);
  follow_stillness(time_ms);
  follow_sparse(time_ms);
  TimedCommand command{.time_ms = time_ms,
                       .tick_ms = std::min(time_ms - last_.time_ms, tick_ms_),
                       .asked = *asked,
                       .force_n = {}};
  if (pose_) command.force_n = wire_.force_n(*pose_, asked->count);
  // Where the arm is stretched out no force at the tip goes with its torques.
  if (!std::isfinite(dot(command.force_n, command.force_n))) command.force_n = last_.force_n;
  heat_until(time_ms);
  follow_stall(command);
  check_state(command);
  if (pose_ && zero_is_known_) {
    check_size(command);
    check_change(command);
    check_hold(command);
    check_direction(command);
    check_program(command);
  }
  if (fresh_ || begins_anew_) held_n_ = command.force_n;
  if (asked->off() && !last_.asked.off()) began_off_ms_ = time_ms;
  if (norm(command.force_n) > kPushN) last_push_ms_ = time_ms;
  last_ = command;
  fresh_ = false;
  silence_told_ = false;
}

void SafetyMonitor::check_state(const TimedCommand& command) {
  for (const std::int16_t count : command.asked.count) {
    check(std::abs(int{count}) <= wire_.count_end(), command.time_ms, "a motor's counts",
          std::abs(int{count}), wire_.count_end());
  }
  if (command.asked.off()) return;
  if (ended_ms_ >= 0) return broken(command.time_ms, "motors on after a signal to end");
  if (off_ == Off::no_reason) return;
  constexpr std::array<const char*, 4> kWhy{"motors on before calibration",
                                            "motors on while parked", "motors on without homing",
                                            "motors on after a fault"};
  broken(command.time_ms, kWhy[static_cast<std::size_t>(off_)]);
}

void SafetyMonitor::check_size(const TimedCommand& command) {
  const double now_n = norm(command.force_n), peak_n = limits_.force_n;
  outcome_.peak_n = std::max(outcome_.peak_n, now_n);
  check(now_n <= peak_n + kStepN, command.time_ms, "force in N", now_n, peak_n);

  const double silent_ms = command.time_ms - heard_ms_;
  const double left_n =
      norm(held_n_) * std::clamp((kZeroMs - silent_ms) / (kZeroMs - kHoldMs), 0.0, 1.0);
  // A host that was late in the silence catches up no faster than the slew allows.
  catches_up_ = !fresh_ && (catches_up_ || command.time_ms - last_.time_ms > 1.5 * tick_ms_);
  const double least_n = norm(last_.force_n) - limits_.slew_n_per_ms * command.tick_ms;
  const double may_be_n = catches_up_ ? std::max(left_n, least_n) : left_n;
  check(fresh_ || now_n <= may_be_n + kStepN, command.time_ms, "force without reports in N", now_n,
        may_be_n);

  // Two ticks: the first one has its share already, and a stall may end one before.
  const double faded_ms = command.time_ms - may_push_since_ms_ + 2 * tick_ms_;
  const double most_n = peak_n * std::min(1.0, faded_ms / kFadeInMs);
  check(now_n <= most_n + kStepN, command.time_ms, "force while fading in, in N", now_n, most_n);

  const double rms_n = std::sqrt(heat_n2_);
  outcome_.rms_n = std::max(outcome_.rms_n, rms_n);
  const double bearable_n = std::min(limits_.continuous_force_n, peak_n);
  check(rms_n <= bearable_n + kStepN, command.time_ms, "RMS over 10 s in N", rms_n, bearable_n);
}

void SafetyMonitor::check_change(const TimedCommand& command) {
  if (command.tick_ms <= 0) return;
  // A hand that moves with the force is given energy by it. Across it, only what the force's steps
  // hide may look so.
  const bool leaves =
      fresh_ && dot(last_.force_n, moved_mm_) > -kStepN * norm(moved_mm_) && norm(moved_mm_) > 0;
  const bool may_fall = leaves || begins_anew_ || command.asked.off();
  const double change = may_fall ? change_but_for_fall_n(last_.force_n, command.force_n)
                                 : norm(command.force_n - last_.force_n);
  const double most_n = limits_.slew_n_per_ms * command.tick_ms;
  outcome_.steepest_n_per_ms = std::max(outcome_.steepest_n_per_ms, change / command.tick_ms);
  check(change <= most_n + kStepN, command.time_ms, "change of the force in a tick, in N", change,
        most_n);
  // And in all, whatever made it fall.
  const double whole_n = norm(command.force_n - last_.force_n);
  const double bound_n = std::max(most_n, norm(last_.force_n));
  check(whole_n <= bound_n + kStepN, command.time_ms, "fall and turn of the force in a tick, in N",
        whole_n, bound_n);
}

/// What was sent after the last report, turned and weakened by nothing.
void SafetyMonitor::check_hold(const TimedCommand& command) {
  // Reports that stand still are none, though they were heard. A pose that is none may have
  // latched.
  const bool may_be_latched =
      no_pose_since_ms_ >= 0 && command.time_ms - no_pose_since_ms_ >= kNotFiniteMs - 1e-6;
  const bool holds = !fresh_ && !stands_still_ && !may_be_latched && !begins_anew_ &&
                     ended_ms_ < 0 && off_ == Off::no_reason &&
                     command.time_ms - heard_ms_ <= kHoldMs;
  const double off_by_n = norm(command.force_n - held_n_);
  check(!holds || off_by_n <= kStepN, command.time_ms, "change of a held force, in N", off_by_n,
        kStepN);
}

void SafetyMonitor::check_direction(const TimedCommand& command) {
  const bool pushes = norm(command.force_n) > kPushN;
  const auto out = pushes && way_in_is_known_ ? outward_.at(pose_->tip_mm) : std::nullopt;
  // Deep in the solid after a jump, out is the way back.
  const bool is_back =
      jumped_from_mm_ && dot(*jumped_from_mm_ - pose_->tip_mm, command.force_n) > 0;
  const bool inward = out && dot(*out, command.force_n) < 0 && !is_back;
  if (!inward) {
    inward_since_ms_ = -1;
    return;
  }
  if (inward_since_ms_ < 0) inward_since_ms_ = command.time_ms;
  const double for_ms = command.time_ms - inward_since_ms_;
  check(for_ms <= kTurnMs, command.time_ms, "ms in which the force points into the solid", for_ms,
        kTurnMs);
}

/// A program that gives nothing any more: its force falls as that of reports that are lost, no
/// faster than the slew allows.
void SafetyMonitor::check_program(const TimedCommand& command) {
  if (!program_stale_ms_) return;
  const double fall_ms = kZeroMs - kHoldMs + limits_.force_n / limits_.slew_n_per_ms;
  const double limit_ms = *program_stale_ms_ + fall_ms + 2 * tick_ms_;
  const double silent_ms = command.time_ms - program_gave_ms_;
  check(silent_ms <= limit_ms || norm(command.force_n) <= kStepN, command.time_ms,
        "force, ms after the program's last one", silent_ms, limit_ms);
}

void SafetyMonitor::heat_until(double time_ms) {
  const double share = -std::expm1((last_.time_ms - time_ms) / kThermalTimeMs);
  heat_n2_ += (dot(last_.force_n, last_.force_n) - heat_n2_) * share;
}

void SafetyMonitor::cycle(double time_ms, const DeviceMoment& device) {
  docked_ = device.docked;
  const double alone_ms = time_ms - last_.time_ms;
  if (ended_ms_ >= 0 && time_ms - ended_ms_ <= kOffMs + kCycleMs) {
    check(last_.asked.off() || time_ms - ended_ms_ <= kOffMs, time_ms,
          "motors on, ms after a signal to end", time_ms - ended_ms_, kOffMs);
  }
  if (!last_.asked.off()) {
    outcome_.longest_alone_ms = std::max(outcome_.longest_alone_ms, alone_ms);
    if (alone_ms > kWatchdogMs + kCycleMs && !silence_told_) {
      silence_told_ = true;
      check(false, time_ms, "motors on, ms after the last packet", alone_ms, kWatchdogMs);
    }
  }
  const double force_n = norm(device.motor_force_n);
  outcome_.device_peak_n = std::max(outcome_.device_peak_n, force_n);
  outcome_.pushed = outcome_.pushed || force_n > kPushN;
  if (told_.parked && told_.homed) service_failed_ms_ = -1;
  const double failed_ms = service_failed_ms_ < 0 ? 0 : time_ms - service_failed_ms_;
  check(failed_ms <= kZeroMs + kCycleMs || force_n < kStepN, time_ms,
        "force of the motors, ms after the service failed", failed_ms, kZeroMs);
  if (!trusted_ || !zero_is_known_ || !zero_is_true_) return;
  const double limit_n = limits_.force_n * kDeviceShare + kStepN;
  check(force_n <= limit_n, time_ms, "force of the motors in N", force_n, limit_n);
  if (!last_.asked.off() || force_n < kStepN) return;
  const double after_ms = time_ms - began_off_ms_;
  outcome_.slowest_off_ms = std::max(outcome_.slowest_off_ms, after_ms);
  check(after_ms <= kOffMs, time_ms, "force of the motors, ms after they went off", after_ms,
        kOffMs);
}

void SafetyMonitor::end(double time_ms, const std::string& latches, double faults_end_ms) {
  outcome_.pushed_again = last_push_ms_ > faults_end_ms;
  if (latches.empty()) return;
  // Counts that lead to no pose may be told from a jump, or from numbers that are none.
  const bool as_written =
      outcome_.latched == latches || (had_no_pose_ && outcome_.latched != fault_name(Fault::none));
  if (!as_written) {
    broken(time_ms, "the reports amount to " + outcome_.latched + ", not " + latches);
    return;
  }
  if (latches == fault_name(Fault::none)) {
    const bool may_push = off_ == Off::no_reason && !calibrated_again_;
    check(outcome_.pushed_again || !may_push, time_ms, "no force after the last fault, in N", 0,
          kPushN);
    return;
  }
  outcome_.latch_ms = std::max(0.0, began_off_ms_ - begun_ms_);
  const double limit_ms = latest_latch_ms(outcome_.latched, tick_ms_);
  check(last_.asked.off() && outcome_.latch_ms <= limit_ms, time_ms,
        "ms until the motors were off for good", outcome_.latch_ms, limit_ms);
}

}  // namespace kerf::faults
