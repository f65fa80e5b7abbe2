// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>

#include <immintrin.h>

// Pairs of densities from anywhere, for AVX2 and AVX-512, by single loads: a gather takes twice as
// long on Zen 4. Internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

/// The densities i and i + 1 of each of four indices i, the first in the low half.
[[gnu::always_inline]] inline __m128i load_four_pairs(const std::uint16_t* density,
                                                      const std::uint32_t* index) noexcept {
  const auto pair = [&](int lane) {
    std::int32_t both;
    std::memcpy(&both, density + index[lane], sizeof both);
    return both;
  };
  return _mm_setr_epi32(pair(0), pair(1), pair(2), pair(3));
}

}  // namespace
}  // namespace kerf
