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

}  // namespace kerf
