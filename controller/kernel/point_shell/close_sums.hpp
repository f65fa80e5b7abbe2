// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// Sums over samples, weighted with a power p of t, their density over the highest (docs/theory.md
/// 3.5). Fixed: t, its powers and offsets in Q15.
template <class N>
struct PowerSums {
  typename N::Sum weight{}, density{}, offset[3]{};  ///< SUM t^p, SUM t^p t, SUM t^p offset
};

/// What a closeup (contact_closeup.hpp) sums over its samples. Where every sample is faint only
/// `top` is set.
template <class N>
struct CloseSums {
  static constexpr int kLowPower = 32, kHighPower = 64;

  PointNumber<N> top{};  ///< density of the highest
  PowerSums<N> low, high;
};

/// t^2. In fixed the product has 32 unsigned bits.
template <class N>
[[nodiscard]] constexpr PointNumber<N> close_square(PointNumber<N> t) noexcept {
  if constexpr (N::kIsFixed) {
    return (t * t + (1 << 14)) >> 15;
  } else {
    return t * t;
  }
}

/// Sums over the table's samples with these densities. The definition: every set has these bits.
template <class N>
[[nodiscard]] constexpr CloseSums<N> close_sums(const PointTable<N>& table,
                                                const PointNumber<N>* density) noexcept {
  using Number = PointNumber<N>;
  CloseSums<N> sums;
  for (std::int32_t i = 0; i < table.count; ++i) sums.top = std::max(sums.top, density[i]);
  if (sums.top < kFaintest<N>) return sums;
  const auto add = [&table](PowerSums<N>& to, Number power, Number t, std::int32_t i) {
    using Sum = typename N::Sum;
    to.weight += power;
    to.density += Sum(power) * t;
    for (std::size_t axis = 0; axis < 3; ++axis)
      to.offset[axis] += Sum(power) * table.offset[axis][i];
  };
  const auto share = [&sums](Number of) {
    if constexpr (N::kIsFixed) {
      const std::uint32_t over_top = (1U << 31) / static_cast<std::uint32_t>(sums.top);
      return static_cast<Number>(static_cast<std::uint32_t>(of) * over_top >> 16);
    } else {
      return of / sums.top;
    }
  };
  for (std::int32_t i = 0; i < table.count; ++i) {
    const Number t = share(density[i]);
    Number power = t;
    for (int p = 1; p < CloseSums<N>::kLowPower; p *= 2) power = close_square<N>(power);
    add(sums.low, power, t, i);
    add(sums.high, close_square<N>(power), t, i);
  }
  return sums;
}

}  // namespace kerf
