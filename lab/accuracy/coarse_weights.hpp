// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf::accuracy {

/// Q0.15 weights rounded half up to `Bits` fraction bits, still in Q0.15: the servo's lerp gives
/// with them the bits that a lerp of `Bits` would give.
template <int Bits>
[[nodiscard]] constexpr VoxelVec<FixedNumbers::Weight> coarse_weights(
    VoxelVec<FixedNumbers::Weight> w) noexcept {
  constexpr int kDropped = 15 - Bits;
  const auto coarse = [](FixedNumbers::Weight v) {
    return static_cast<FixedNumbers::Weight>(round_shift(v, kDropped)) * (1 << kDropped);
  };
  return {coarse(w.x), coarse(w.y), coarse(w.z)};
}

}  // namespace kerf::accuracy
