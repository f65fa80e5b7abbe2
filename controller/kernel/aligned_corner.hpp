// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/aligned_table.hpp"
#include "shared/numeric/fixed.hpp"

namespace kerf {

/// From the exact tap sum of one corner of the method `aligned` to density steps per voxel times
/// 2^8, rounded half up.
[[nodiscard]] constexpr std::int64_t kept_bits(const ExactTaps& taps, std::int64_t sum) noexcept {
  return round_shift(taps.factor * sum, taps.shift - kAlignedKeptBits);
}

}  // namespace kerf
