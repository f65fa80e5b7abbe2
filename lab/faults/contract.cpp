// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/contract.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>

#include "shared/numeric/vec3.hpp"

namespace kerf::faults {
namespace {

// The contract: docs/safety.md.
constexpr double kSlewNPerMs = 0.5;
constexpr double kHoldMs = 5, kZeroMs = 20, kFadeInMs = 100, kOffMs = 2;
constexpr double kNotFiniteMs = 2;  // from the first tick without a finite pose
constexpr double kReportMs = 1;     // from one report to the next, of the slowest device
// A step of the converters is 0.4 to 5 mN at the tip, and the watch is on the outside of them.
constexpr double kStepN = 0.01;
constexpr double kDeviceShare = 1.03;  // the tip moves on while a command is under way
constexpr std::size_t kMaxListed = 4;

/// From the start of a fault at the device until the servo has latched `name`. A fault that the
/// servo bears for a while begins for it with the report that first shows it, or that is missing.
double latest_latch_ms(const std::string& name) {
  if (name == fault_name(Fault::stale_input)) return kZeroMs + kReportMs;
  if (name == fault_name(Fault::not_finite)) return kNotFiniteMs + kReportMs;
  return kOffMs;
}

}  // namespace

void Contract::check(bool kept, double time_ms, const char* rule, double value, double limit) {
  if (kept) return;
  char line[128];
  std::snprintf(line, sizeof line, "%s: %.3f, limit %.3f", rule, value, limit);
  broken(time_ms, line);
}

void Contract::broken(double time_ms, const std::string& what) {
  ++outcome_.violation_count;
  if (outcome_.violations.size() >= kMaxListed) return;
  char time[24];
  std::snprintf(time, sizeof time, "%.3f s: ", time_ms / 1000);
  outcome_.violations.emplace_back(time + what);
}

void Contract::tick(double time_ms, const ServoOutput& output) {
  const double now_n = vec3::length(output.force_n);
  const bool may_push = output.phase == Phase::ramping || output.phase == Phase::active;
  check(output.motors_on <= may_push, time_ms, "motors on in a phase that forbids it",
        static_cast<double>(output.phase), 0);
  check(!output.motors_on || output.fault == Fault::none, time_ms, "motors on with a fault",
        static_cast<double>(output.fault), 0);
  check(output.motors_on || now_n == 0, time_ms, "force with the motors off", now_n, 0);
  check(now_n <= peak_n_, time_ms, "force in N", now_n, peak_n_);

  const double rise = (now_n - last_n_) * ticks_per_ms_;
  check(rise <= kSlewNPerMs + kStepN, time_ms, "rise in N/ms", rise, kSlewNPerMs);
  outcome_.steepest_n_per_ms = std::max(outcome_.steepest_n_per_ms, rise);
  outcome_.peak_n = std::max(outcome_.peak_n, now_n);

  stale_ticks_ = output.stale ? stale_ticks_ + 1 : 0;
  if (!output.stale) held_n_ = now_n;
  const double stale_ms = static_cast<double>(stale_ticks_) / ticks_per_ms_;
  const double fading = std::clamp((kZeroMs - stale_ms) / (kZeroMs - kHoldMs), 0.0, 1.0);
  const double left_n = held_n_ * fading;
  check(!output.stale || now_n <= left_n + kStepN, time_ms, "force without reports in N", now_n,
        left_n);
  check(stale_ms < kZeroMs || now_n == 0, time_ms, "force 20 ms after the last report", now_n, 0);

  on_ticks_ = output.motors_on ? on_ticks_ + 1 : 0;
  const double ramp = std::min(1.0, static_cast<double>(on_ticks_) / ticks_per_ms_ / kFadeInMs);
  check(now_n <= peak_n_ * ramp + kStepN, time_ms, "force while fading in, in N", now_n,
        peak_n_ * ramp);
  if (output.fault != Fault::none && outcome_.latched == fault_name(Fault::none)) {
    outcome_.latched = fault_name(output.fault);
    outcome_.latch_ms = time_ms - begun_ms_;
  }
  if (on_ && !output.motors_on) off_since_ms_ = time_ms;
  on_ = output.motors_on;
  last_n_ = now_n;
}

void Contract::end(double time_ms, const std::string& latches) {
  if (latches.empty()) return;
  if (outcome_.latched != latches) {
    broken(time_ms, "latched " + outcome_.latched + ", not " + latches);
  } else if (outcome_.latched != fault_name(Fault::none)) {
    const double limit_ms = latest_latch_ms(latches);
    check(outcome_.latch_ms <= limit_ms, time_ms, "ms until it was latched", outcome_.latch_ms,
          limit_ms);
  }
}

void Contract::device_force(double time_ms, double force_n, bool trusted) {
  outcome_.device_peak_n = std::max(outcome_.device_peak_n, force_n);
  if (!trusted) return;
  const double limit_n = peak_n_ * kDeviceShare + kStepN;
  check(force_n <= limit_n, time_ms, "force of the motors in N", force_n, limit_n);
  if (on_ || force_n < kStepN) return;
  const double after_ms = time_ms - off_since_ms_;
  outcome_.slowest_off_ms = std::max(outcome_.slowest_off_ms, after_ms);
  check(after_ms <= kOffMs, time_ms, "force of the motors, ms after they went off", after_ms,
        kOffMs);
}

}  // namespace kerf::faults
