// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/law/law_row.hpp"

namespace kerf::laws {

/// How one law behaved in one kind of numbers.
struct Trial {
  std::string numbers;      ///< fixed, float, double
  std::uint64_t steps = 0;  ///< that it took
  double step_ns = 0;       ///< the mean of them
  std::string fault;        ///< empty: none. One line: what, with which settings and input; way out
};

/// Tries a law in a process of its own: its settings at their defaults, and each and all of them at
/// both ends; inputs at the ends of their ranges, at 0, one step from it and between, 20,000 for
/// each set of settings, the same in every trial. Faults: what is no number, what allocates, what
/// does not end in 2 s of processor time for each kind of numbers, what ends the process.
///
/// The process must have one thread. Allocations are not counted under sanitizers.
[[nodiscard]] std::vector<Trial> try_law(const LawRow& row);

}  // namespace kerf::laws
