// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/servo/device_report.hpp"
#include "controller/servo/servo_output.hpp"

namespace kerf::ranges {

/// A rule that was broken; of each rule the first tick is kept.
struct Violation {
  std::string rule;
  std::string what;
};

/// What every tick of every scene keeps, whatever the hand does (docs/safety.md). Rules:
///
///   finite      every number of the output is one
///   clamp       |F| is at most limits.force_n
///   slew        |F - F'| is at most limits.slew_n_per_ms; but a force may fall along its own
///               direction at once where the hand leaves with it or a motor is at its end, and the
///               motors may go off
///   off         motors that are off get no counts and give no force; they are on without a fault
///               only, while the phase is ramping or active
///   stale       without reports no force grows; after 20 ms the motors are off
///   overspeed   a hand faster than limits.speed_mm_per_s has no motors in the same tick
///   energy      a tick books at most the largest force times the way of the tip
///   work        contact reads no more samples than the scene was planned with
class Rules {
 public:
  /// `most_samples` of the active tool in a tick.
  Rules(const LoadedScene& scene, std::uint64_t most_samples);

  void look_at(const DeviceReport& report, const ServoOutput& out);
  void broken(const char* rule, std::string what);
  [[nodiscard]] const std::vector<Violation>& violations() const { return violations_; }

 private:
  using Vector = std::array<double, 3>;
  void look_at_force(const ServoOutput& out, bool leaves);
  void look_at_motion(const DeviceReport& report, const ServoOutput& out, double way_mm);

  double force_n_, slew_n_, limit_mm_, scale_, place_error_mm_, energy_error_;
  std::uint64_t most_samples_;
  bool legs_;
  int motor_end_;
  std::size_t zero_ticks_, tick_ = 0, stale_ticks_ = 0, gap_ = 0;
  bool known_ = false;  ///< where the tip was
  Vector last_force_n_{}, last_mm_{};
  double last_mj_ = 0, largest_gap_n_ = 0;
  std::vector<Violation> violations_;
};

}  // namespace kerf::ranges
