// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/cover_table.hpp"

// Internal linkage, for the reason told at KernelSet.

namespace kerf {
namespace {

/// Where the group begins, the lanes from `lane` on being covered as `lanes` says: at the first
/// that is, but so that it does not reach farther beyond the row's end than from `lane` on.
[[gnu::always_inline]] inline std::int32_t group_begin(const CoverRow& row, std::int32_t lane,
                                                       std::uint32_t lanes) noexcept {
  const std::int32_t first = lane + __builtin_ctz(lanes), last = row.count - kCoverGroup;
  const std::int32_t end = last > lane ? last : lane;
  return first < end ? first : end;
}

}  // namespace
}  // namespace kerf
