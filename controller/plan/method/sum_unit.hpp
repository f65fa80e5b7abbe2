// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "controller/kernel/exact_taps.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/wide_sum.hpp"

namespace kerf {

/// What an exact integer sum holds.
struct SumUnit {
  double steps;    ///< density steps per voxel edge in one unit
  double largest;  ///< bound of the sum, in units
};

/// The two sums of a method.
struct SumUnits {
  SumUnit contact, modification;
};

/// Sums of stored gradients times weights of 2^15; `terms` bounds the number of full weights.
[[nodiscard]] inline SumUnit gathered_sum(double terms) {
  return {std::ldexp(1.0, -15), std::ldexp(std::max(terms, 1.0), 30)};
}

/// Sums of exact gradients times weights of 2^15, as far as `sum_shift` keeps them.
[[nodiscard]] inline SumUnit exact_sum(const ExactTaps& taps, std::size_t samples) {
  const int bits = 15 - sum_shift(samples);
  return {std::ldexp(taps.factor, -taps.shift - bits),
          std::ldexp(static_cast<double>(samples) * static_cast<double>(kMaxExactGradient), bits)};
}

}  // namespace kerf
