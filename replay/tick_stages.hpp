// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "shared/segment/layout.hpp"

// Compares a recorded tick with the same tick computed again.

namespace kerf {

/// The first field in which two records of one tick differ, in the order of the servo step.
struct TickDifference {
  std::string_view stage;  ///< pose, safety, contact, force, cut, energy or output
  std::string field;       ///< column of the log, with its element: "contact_force_n[1]"
  std::string recorded, replayed;
};

/// Compares, bit by bit, everything that report, commands and earlier ticks determine: all columns
/// except the inputs themselves, times, lost packets and checksums. Empty if all are equal.
[[nodiscard]] std::optional<TickDifference> first_difference(const TickRecord& recorded,
                                                             const TickRecord& replayed);

}  // namespace kerf
