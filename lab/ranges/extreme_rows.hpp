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
  /// Measures a rule that no test shows; null if tests do. Returns the finding, and adds violations
  /// to the list.
  std::string (*measure)(const StudySize&, const std::vector<KeyRow>& keys,
                         std::vector<Violation>&);
  std::vector<ShownBy> shown_by;
};

/// All of them. `keys` of a measurement: the rows of `study_keys`.
[[nodiscard]] std::span<const ExtremeRow> extreme_rows();

}  // namespace kerf::ranges
