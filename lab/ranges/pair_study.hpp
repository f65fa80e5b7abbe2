// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "lab/ranges/key_study.hpp"

namespace kerf::ranges {

/// All pairs of ends of two keys.
struct PairRows {
  std::size_t arrays = 0;
  std::size_t pairs = 0, together = 0;  ///< of one array's pairs; that stood together in a run
  std::size_t never = 0;                ///< that contradict each other, or are refused together
  Tally tally;
};

/// Covering arrays of the accepted ends, one after the other until there are as many combinations
/// as the effort says. A row that the loader refuses gives up the key that the refusal names, until
/// it loads; pairs that were lost so are tried by themselves after the first array.
[[nodiscard]] PairRows study_pairs(const std::vector<KeyRow>& keys, const Effort& effort,
                                   const StudyEvents& events);

/// Takes keys out of a scene as long as it still breaks the rule.
[[nodiscard]] Broken shrunk(Broken broken);

}  // namespace kerf::ranges
