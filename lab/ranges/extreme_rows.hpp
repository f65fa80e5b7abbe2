// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "lab/ranges/key_study.hpp"

namespace kerf::ranges {

/// A case of a test that shows a rule: its file below tests/, and its name.
struct ShownBy {
  const char *file, *name;
};

/// One extreme and the rule that holds at it.
struct ExtremeRow {
  const char* name;
  const char* rule;
  /// Measures what no test shows; null: the tests do. Tells what was found, and breaks by adding
  /// to the tally.
  std::string (*measure)(const Effort&, const std::vector<KeyRow>& keys, std::vector<Violation>&);
  std::vector<ShownBy> shown_by;
};

/// All of them. `keys` of a measurement: what `study_keys` found.
[[nodiscard]] std::span<const ExtremeRow> extreme_rows();

}  // namespace kerf::ranges
