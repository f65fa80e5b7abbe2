// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "controller/stability/limit_cycle.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/tick_watch.hpp"

namespace kerf::zwidth {

/// A hit that is still open is followed for so long, s.
inline constexpr double kLimitS = 60, kLongestLimitS = 600;
inline constexpr std::size_t kMostSeeds = 200;

/// The specification of a map. Two runs with the same value give the same map, bit for bit.
struct MapSpec {
  std::array<std::size_t, 2> mapped{};  ///< axes of the picture, `kAxisCount`: stiffness
  std::vector<double> stiffness_n_per_mm;
  AxisTable table;
  bool arm = false;          ///< the whole servo with an emulated device, else one axis
  double seconds = kLimitS;  ///< to which a hit that is still open is followed, at least
  std::uint64_t seed = 1;    ///< the first one
  std::size_t seeds = 5;     ///< so many, one after the other; one alone if encoders have no steps

  [[nodiscard]] std::vector<Assignment> columns() const { return combinations(table); }
};

/// The stiffness at which a column stops being fine, by one rule.
struct StabilityBoundary {
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  /// The lowest stiffness, within 0.5 %, at which a press of any seed is bad, of all that were
  /// tried; 0: the lowest of all is; kNever: none is.
  double first_n_per_mm = kNever;
  double last_n_per_mm = kNever;  ///< the largest first one of a single seed
  /// Cells above it that are fine again, their lowest and highest; 0: none.
  double re_entry_from_n_per_mm = 0, re_entry_to_n_per_mm = 0;
  std::vector<double> by_seed_n_per_mm{};  ///< the first one of each seed
};

/// One combination of the other axes, at all stiffnesses.
struct Column {
  std::vector<LimitCycle> cells;  ///< empty: it cannot exist, or the hand never met the wall
  StabilityBoundary swing, energy;
  /// The lowest stiffness at which a hit is undecided; kNever: none.
  double undecided_n_per_mm = StabilityBoundary::kNever;
};
using Columns = std::map<std::size_t, Column>;

/// The limit that a press needs, s, that separates a swing that dies out from one that does not: in
/// half of it eight windows of the slowest swing; twelve time constants of an overdamped creep; and
/// if damping b takes the swing away, at the rate b/(2 m) without a wall and less and less up to
/// the boundary, so long that at 1 % of that rate it falls by 9 %.
[[nodiscard]] double needed_seconds(const LoopCase& subject, double stiffness_n_per_mm,
                                    const Press& press);

/// The reason if a column cannot exist: its damping alone is beyond what any sampled wall may have,
/// the emulated device cannot have its delay or rate, or a hit would last for more than ten
/// minutes; else empty.
[[nodiscard]] std::string impossible(const MapSpec& spec, const LoopCase& subject);

/// The column of `values`. Throws Interrupted.
[[nodiscard]] Column measure_column(const MapSpec& spec, const Assignment& values,
                                    StepCounter& ticks);

/// Called with each column as it comes, under a lock, and with the ticks that it took.
using ColumnDone = std::function<void(std::size_t index, Column column, std::uint64_t ticks)>;

/// Measures the columns of `wanted` on `jobs` threads, until all are done or `stop` is set: a
/// column that is not done then is lost. An exception of a thread is thrown here. A step that does
/// not end ends the program (`TickWatch`).
void measure_columns(const MapSpec& spec, const std::vector<std::size_t>& wanted, std::size_t jobs,
                     const std::atomic<bool>& stop, const ColumnDone& done);

/// Phase portraits as JSON (lab/report/stability_map.py has its form): position of the tip and its
/// speed, one curve for each hit of each cell. `cells` are 1 to 12 texts "stiffness:damping" in
/// N/mm and N s/mm; all else is that of the map's one column. Throws HilError that names the
/// option.
[[nodiscard]] std::string portraits_of(const MapSpec& spec, const std::vector<std::string>& cells);

}  // namespace kerf::zwidth
