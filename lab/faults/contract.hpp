// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "controller/servo/servo_output.hpp"
#include "lab/faults/fault_run.hpp"

namespace kerf::faults {

/// Watches the commands of a run, tick by tick, and says where they break the safety contract. It
/// knows what the servo step promises, not how it does it.
class Contract {
 public:
  Contract(int rate_hz, double peak_n, Outcome& outcome) noexcept
      : ticks_per_ms_(rate_hz / 1000.0), peak_n_(peak_n), outcome_(outcome) {}

  /// One tick of the servo, at `time_ms`.
  void tick(double time_ms, const ServoOutput& output);
  /// Something went wrong for the first time.
  void fault_begins(double time_ms) noexcept { begun_ms_ = time_ms; }
  /// The run is over; `latches` as in FaultScript.
  void end(double time_ms, const std::string& latches);
  /// The watchdog switched the motors off in the servo's place: its next force begins at zero.
  void watchdog_off() noexcept { last_n_ = 0; }
  /// Force of the motors at the true tip; `trusted`: neither sensors nor commands are broken, so it
  /// must follow the commands.
  void device_force(double time_ms, double force_n, bool trusted);

 private:
  void check(bool kept, double time_ms, const char* rule, double value, double limit);
  void broken(double time_ms, const std::string& what);

  double ticks_per_ms_;
  double peak_n_;
  Outcome& outcome_;
  double last_n_ = 0;
  double held_n_ = 0;  ///< with the last fresh report
  std::uint64_t stale_ticks_ = 0;
  std::uint64_t on_ticks_ = 0;  ///< since the motors came on
  double off_since_ms_ = 0;
  bool on_ = false;
  double begun_ms_ = 0;
};

}  // namespace kerf::faults
