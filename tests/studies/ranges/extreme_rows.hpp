// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tests/studies/ranges/key_study.hpp"
#include "tests/studies/ranges/rules.hpp"

namespace kerf::ranges {

/// A case of a test that shows a rule: its file below tests/, and its name.
struct ShownBy {
  const char *file, *name;
};

/// One extreme and the rule that holds at it.
struct ExtremeRow {
  const char* name;
  const char* rule;
  /// Measures a rule that no test shows; null if tests do. Returns the finding, and adds violations
  /// to the list.
  std::string (*measure)(const StudySize&, const std::vector<KeyRow>& keys,
                         std::vector<Violation>&);
  std::vector<ShownBy> shown_by;
};

/// All of them. `keys` of a measurement: the rows of `study_keys`.
[[nodiscard]] std::span<const ExtremeRow> extreme_rows();

/// The outcome of a long run. Rules besides those of every tick (rules.hpp):
///
///   halves   the second half, by another servo that was restored from the state between the two,
///            ends in the same bits
///   carry    cutting owes at most one voxel
///   ledger   the energy that ticks without a gap book is SUM -F . dx, to the numbers' rounding
///   clock    the force fades in over the same ticks each time
///   removed  densities fell by exactly the amount that the ticks reported
struct LongRun {
  std::uint64_t ticks = 0, removed = 0, ramps = 0;
  std::uint64_t shortest_ramp = 0, longest_ramp = 0;  ///< ticks
  double largest_carry = 0;                           ///< voxels
  double absorbed_mj = 0, ledger_off_mj = 0;
  double first_cycle_mj = 0, last_cycle_mj = 0;  ///< taken from the hand in one round of it
  double ticks_per_s = 0;
  std::vector<Violation> violations;
};

/// The hard hand round after round on a half space that it cuts as slowly as a scene can ask for,
/// 1000 ticks a second. `progress` gets the share that is done, 0..1.
[[nodiscard]] LongRun run_long(NumericKind numeric, std::uint64_t ticks,
                               const std::function<void(double share)>& progress);

}  // namespace kerf::ranges
