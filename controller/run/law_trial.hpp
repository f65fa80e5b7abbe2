// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "controller/load/loaded_scene.hpp"

namespace kerf {

/// Faults of a law.
enum class LawFlaw : std::uint8_t {
  none,
  no_number,
  allocates,
  unlisted,  ///< reads a setting that is not in its list
  endless,
  ends_program
};

/// How one law behaved in one kind of numbers.
struct LawTrial {
  std::string numbers;      ///< fixed, double
  std::uint64_t steps = 0;  ///< that it took
  double step_ns = 0;       ///< the mean of them
  LawFlaw flaw = LawFlaw::none;
  std::string fault;  ///< empty if none; else one line: fault, settings and input; remedy
};

/// Tries a law in a process of its own: its settings at their defaults, and each and all of them at
/// both ends; inputs at the ends of their ranges, at 0, one step from it and between, 20,000 for
/// each set of settings, the same in every trial. Flaws: a result that is no number, an
/// allocation, no end in 2 s of processor time for each kind of numbers, an end of the process.
///
/// The process must have one thread. Allocations are not counted under sanitizers.
[[nodiscard]] std::vector<LawTrial> try_law(const LawRow& row);

/// Tries the laws of a scene that a project adds, with the settings and the numbers of the scene,
/// before any other code runs them: 2,000 of the same inputs, 2 s each. So an endless law is found
/// before the device has force; in lock-step no watchdog would end it. The laws of kerf have tests.
///
/// Returns a line for each that gives no number or allocates: the servo tolerates both. Throws
/// std::runtime_error, one line, for one that does not end or ends its process. An unlisted setting
/// is refused when the law is planned. One thread.
[[nodiscard]] std::vector<std::string> try_own_laws(const LoadedScene& scene);

}  // namespace kerf
