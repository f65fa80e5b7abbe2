// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "shared/segment/layout.hpp"

// A tick as it was recorded beside the same tick computed again.

namespace kerf {

/// The first field in which two records of one tick differ, in the order of the servo step.
struct TickDifference {
  std::string_view stage;  ///< pose, safety, contact, force, cut, energy or output
  std::string field;       ///< column of the log, with its element: "contact_force_n[1]"
  std::string recorded, replayed;
};

/// Compares all that report, commands and earlier ticks determine, bit by bit: every column but
/// the inputs themselves, times, losses on the way and checksums. Empty if all are equal.
[[nodiscard]] std::optional<TickDifference> first_difference(const TickRecord& recorded,
                                                             const TickRecord& replayed);

}  // namespace kerf
