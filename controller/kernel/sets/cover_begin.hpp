// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/cover_table.hpp"

// Internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

/// Voxel of the row at which a group of kCoverGroup begins. Bit i of `lanes`, not 0, says whether
/// the tool covers voxel `lane` + i. The group begins at the first covered voxel; near the end of
/// the row it begins earlier, never before `lane`, so that it reaches no farther beyond the end
/// than one from `lane` on would.
[[gnu::always_inline]] inline std::int32_t group_begin(const CoverRow& row, std::int32_t lane,
                                                       std::uint32_t lanes) noexcept {
  const std::int32_t first = lane + __builtin_ctz(lanes), last = row.count - kCoverGroup;
  const std::int32_t end = last > lane ? last : lane;
  return first < end ? first : end;
}

}  // namespace
}  // namespace kerf
