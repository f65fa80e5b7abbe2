// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/plan/method/matrices.hpp"
#include "controller/plan/method/sum_unit.hpp"
#include "controller/servo/sum_to_force.hpp"

namespace kerf {

/// Smallest n with 2^n >= x; exact, unlike a logarithm, whose last bit differs between machines.
[[nodiscard]] inline int bits_of(double x) {
  const int floor = std::ilogb(x);
  return std::ldexp(1.0, floor) < x ? floor + 1 : floor;
}

/// Newtons per unit of an exact sum, as the loop's numbers hold it.
template <class N>
[[nodiscard]] SumToForce<N> sum_to_force(const Matrix& newtons_per_step, const SumUnit& sum) {
  SumToForce<N> map;
  if constexpr (N::kIsFixed) {
    // 38 bits of the largest sum are kept.
    map.pre_shift = std::max(0, bits_of(sum.largest) - 38);
    double largest = 0;
    for (const auto& row : newtons_per_step) {
      for (const double value : row) largest = std::max(largest, std::abs(value));
    }
    // The kept sum times `unit` newtons is the force in steps of 2^-16 N.
    const double unit = std::ldexp(sum.steps, map.pre_shift + 16);
    constexpr double kMantissaMax = 4194303;  // 22 bits
    constexpr int kMaxShift = 61;
    map.post_shift =
        largest == 0 ? 0 : std::clamp(std::ilogb(kMantissaMax / (largest * unit)), 0, kMaxShift);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        map.mantissa[i][j] = static_cast<std::int32_t>(
            std::clamp(std::round(std::ldexp(newtons_per_step[i][j] * unit, map.post_shift)),
                       -kMantissaMax, kMantissaMax));
      }
    }
  } else {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        map.row[i][j] = static_cast<typename N::Real>(newtons_per_step[i][j]);
      }
    }
  }
  return map;
}

}  // namespace kerf
