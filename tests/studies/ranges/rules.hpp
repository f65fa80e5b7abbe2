// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/servo/servo.hpp"
#include "shared/numeric/fnv1a.hpp"

/// Rules of every tick, and the state of a servo as hashes and sums.
namespace kerf::ranges {

/// A rule that was broken; of each rule the first tick is kept.
struct Violation {
  std::string rule;
  std::string what;
};

/// The rules that every tick of every scene keeps, for any input (docs/safety.md):
///
///   finite      every number of the output is one
///   clamp       |F| is at most limits.force_n
///   slew        |F - F'| is at most limits.slew_n_per_ms; but a force may fall along its own
///               direction at once if the hand leaves with it or a motor is at its end, and the
///               motors may go off; in all by no more than |F'|, or the slew
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

  double force_n_, slew_n_, limit_mm_, scale_, place_error_mm_;
  std::uint64_t most_samples_;
  bool legs_;
  int motor_end_;
  std::size_t zero_ticks_, tick_ = 0, stale_ticks_ = 0, gap_ = 0;
  bool known_ = false;  ///< the last position of the tip
  Vector last_force_n_{}, last_mm_{};
  double last_mj_ = 0, largest_gap_n_ = 0;
  std::vector<Violation> violations_;
};

/// Sum of all densities of the scene.
[[nodiscard]] inline std::uint64_t sum_of(const AnyServo& servo, std::size_t volumes) {
  std::uint64_t sum = 0;
  for (std::size_t v = 0; v < volumes; ++v) {
    const auto density = servo.density(v);
    sum = std::accumulate(density.begin(), density.end(), sum);
  }
  return sum;
}

/// Hash of the last output and the state after it; the output hash is a chain over all ticks.
[[nodiscard]] inline std::uint64_t hash_of(const AnyServo& servo, std::size_t volumes,
                                           const ServoOutput& last) {
  std::uint64_t hash = fnv1a_step(last.output_hash, std::bit_cast<std::uint64_t>(last.absorbed_mj));
  for (const double mm : last.position_mm)
    hash = fnv1a_step(hash, std::bit_cast<std::uint64_t>(mm));
  for (const double mm : last.proxy_offset_mm) {
    hash = fnv1a_step(hash, std::bit_cast<std::uint64_t>(mm));
  }
  for (std::size_t v = 0; v < volumes; ++v) {
    for (const Density density : servo.density(v)) hash = fnv1a_step(hash, density);
  }
  return hash;
}

/// The most samples that contact may read in a tick of the active tool.
[[nodiscard]] inline std::uint64_t most_samples(const SceneCosts& costs, const LoadedScene& scene) {
  std::uint64_t samples = 0;
  for (const TickCost& cost : costs.ticks) {
    const bool counts = cost.tool == scene.active_tool && cost.shape.swept;
    if (counts) samples += cost.stages.front().operations;
  }
  return samples;
}

}  // namespace kerf::ranges
