// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace kerf {

/// Samples whose sum of exact gradients, 2^15 of them each, is sure to stay below 2^62.
inline constexpr std::size_t kNarrowSumSamples = 18'000;

/// Bits that the finished sum of a tool with this many samples leaves out: none, or 16.
[[nodiscard]] constexpr int sum_shift(std::size_t samples) noexcept {
  return samples <= kNarrowSumSamples ? 0 : 16;
}

/// SUM of terms over 2^shift, rounded down once at the end: the order of terms does not matter.
/// With a shift of 16 the sum may have 79 bits.
struct WideSum {
  std::int64_t high = 0, low = 0;

  [[gnu::always_inline]] constexpr void add(std::int64_t term, int shift) noexcept {
    high += term >> shift;
    low += term & ((std::int64_t{1} << shift) - 1);
  }
  [[gnu::always_inline]] [[nodiscard]] constexpr std::int64_t over(int shift) const noexcept {
    return high + (low >> shift);
  }
};

/// Gradient taps whose slopes have no common factor: it is applied once, to the finished sum, which
/// is then divided by 2^shift. Exact sums are before both.
struct ExactTaps {
  std::int32_t smooth[5];
  std::int32_t slope[5];
  std::int32_t factor;
  std::int32_t shift;
};

inline constexpr ExactTaps kExactFarid{{5, 32, 55, 32, 5}, {-2, -5, 0, 5, 2}, 7, 21};
inline constexpr ExactTaps kExactSobel5{{1, 4, 6, 4, 1}, {-1, -2, 0, 2, 1}, 1, 11};
/// The central difference, scaled as sobel5.
inline constexpr ExactTaps kExactCentral{{0, 0, 32, 0, 0}, {0, -1, 0, 1, 0}, 1, 11};

/// The exact gradient of a voxel, times 2^21 / 7, is at most this for farid, less for sobel5: half
/// the slope taps' sum times the smooth taps' squared, times full density.
inline constexpr std::int64_t kMaxExactGradient = std::int64_t{7} * 129 * 129 * 65535;
static_assert(kNarrowSumSamples <= (std::uint64_t{1} << 62) / 32768 / kMaxExactGradient);

}  // namespace kerf
