// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"

namespace kerf {

/// What a law must not do.
enum class LawFlaw : std::uint8_t {
  none,
  no_number,
  allocates,
  unlisted,  ///< it reads a setting that its list has not
  endless,
  ends_program
};

/// How one law behaved in one kind of numbers.
struct LawTrial {
  std::string numbers;      ///< fixed, float, double
  std::uint64_t steps = 0;  ///< that it took
  double step_ns = 0;       ///< the mean of them
  LawFlaw flaw = LawFlaw::none;
  std::string fault;  ///< empty: none. One line: what, with which settings and input; way out
};

/// Tries a law in a process of its own: its settings at their defaults, and each and all of them at
/// both ends; inputs at the ends of their ranges, at 0, one step from it and between, 20,000 for
/// each set of settings, the same in every trial. Flaws: what is no number, what allocates, what
/// does not end in 2 s of processor time for each kind of numbers, what ends the process.
///
/// The process must have one thread. Allocations are not counted under sanitizers.
[[nodiscard]] std::vector<LawTrial> try_law(const LawRow& row);

/// Tries the laws of a scene that are the program's own, as the scene sets them and in its numbers,
/// before anything else runs them: 2,000 of the same inputs, 2 s each. In lock-step no watchdog
/// ends a tick, and what no watchdog can end is met before the hand is held. kerf's own are tested.
///
/// Returns a line for each that gives what is no number or allocates: the servo bears both. Throws
/// std::runtime_error, one line, for one that does not end or ends its process. An unlisted setting
/// is refused where the law is planned. One thread.
[[nodiscard]] std::vector<std::string> try_own_laws(const LoadedScene& scene);

}  // namespace kerf
