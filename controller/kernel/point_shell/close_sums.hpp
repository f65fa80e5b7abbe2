// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// The close samples of one look, in whole groups. What fills up the last has density 0.
template <class N>
struct CloseLook {
  std::int32_t count = 0;
  const PointNumber<N>* offset[3] = {};  ///< as in CloseTable
  const PointNumber<N>* normal[3] = {};
  PointNumber<N> middle[3] = {}, radius{};  ///< of the look, as the offsets
  const PointNumber<N>* density = nullptr;
  PointNumber<N>* window = nullptr;  ///< memory for how much each counts
};

/// Sums over samples, weighted with a power p of t, their density over the highest (docs/theory.md
/// 3.5). Fixed: t, its powers, offsets and normals in Q15.
template <class N>
struct PowerSums {
  typename N::Sum weight{}, density{}, offset[3]{};  ///< SUM t^p, SUM t^p t, SUM t^p offset
};
template <class N>
struct NormalSums {
  typename N::Sum weight{}, normal[3]{};  ///< SUM t^p, SUM t^p normal
};

/// What a closeup (contact_closeup.hpp) sums over its samples. Where every sample is faint only
/// `top` is set.
template <class N>
struct CloseSums {
  static constexpr int kLowPower = 32, kHighPower = 64;  ///< of height and place
  static constexpr int kNormalPower = 16;                ///< of the tool's normal

  PointNumber<N> top{};  ///< density of the highest
  NormalSums<N> facing;
  PowerSums<N> low, high;
};

/// a b of shares, 0 to 1; fixed: Q15.
template <class N>
[[nodiscard]] constexpr PointNumber<N> share_product(PointNumber<N> a, PointNumber<N> b) noexcept {
  if constexpr (N::kIsFixed) {
    return (a * b + (1 << 14)) >> 15;
  } else {
    return a * b;
  }
}

/// How much a sample at `offset` counts: (1 - d^2/R^2)^2 at the distance d from the middle of the
/// look, 0 from its radius R on. So samples come and go without a jump as the look moves on
/// (docs/theory.md 3.5). `over_radius`: 2^30 over the radius; of floating point 1 over it.
template <class N>
[[nodiscard]] constexpr PointNumber<N> close_window(const CloseLook<N>& look,
                                                    PointNumber<N> over_radius,
                                                    std::int32_t i) noexcept {
  using Number = PointNumber<N>;
  Number rest = N::kIsFixed ? Number(1 << 15) : Number(1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Number along =
        std::clamp(look.offset[axis][i] - look.middle[axis], -look.radius, look.radius);
    Number share = along * over_radius;
    if constexpr (N::kIsFixed) share >>= 15;
    rest -= share_product<N>(share, share);
  }
  rest = std::max(rest, Number(0));
  return share_product<N>(rest, rest);
}
/// See there.
template <class N>
[[nodiscard]] constexpr PointNumber<N> over_radius(const CloseLook<N>& look) noexcept {
  return (N::kIsFixed ? PointNumber<N>(1 << 30) : PointNumber<N>(1)) / look.radius;
}

/// Sums over the samples of a look. The definition: every set has these bits.
template <class N>
[[nodiscard]] constexpr CloseSums<N> close_sums(const CloseLook<N>& look) noexcept {
  using Number = PointNumber<N>;
  CloseSums<N> sums;
  const Number over = over_radius(look);
  for (std::int32_t i = 0; i < look.count; ++i) {
    look.window[i] = close_window(look, over, i);
    if (look.window[i] > Number(0)) sums.top = std::max(sums.top, look.density[i]);
  }
  if (sums.top < kFaintest<N>) return sums;
  using Sum = typename N::Sum;
  const auto add_normal = [&look](NormalSums<N>& to, Number power, std::int32_t i) {
    to.weight += power;
    for (std::size_t axis = 0; axis < 3; ++axis)
      to.normal[axis] += Sum(power) * look.normal[axis][i];
  };
  const auto add = [&look](PowerSums<N>& to, Number power, Number t, std::int32_t i) {
    to.weight += power;
    to.density += Sum(power) * t;
    for (std::size_t axis = 0; axis < 3; ++axis)
      to.offset[axis] += Sum(power) * look.offset[axis][i];
  };
  const auto windowed = [&look](Number power, std::int32_t i) {
    return share_product<N>(power, look.window[i]);
  };
  const auto share = [&sums](Number of) {
    if constexpr (N::kIsFixed) {
      const std::uint32_t over_top = (1U << 31) / static_cast<std::uint32_t>(sums.top);
      return static_cast<Number>(static_cast<std::uint32_t>(of) * over_top >> 16);
    } else {
      return of / sums.top;
    }
  };
  for (std::int32_t i = 0; i < look.count; ++i) {
    if (!(look.window[i] > Number(0))) continue;  // it may be higher than the highest that counts
    const Number t = share(look.density[i]);
    Number power = t;
    for (int p = 1; p < CloseSums<N>::kNormalPower; p *= 2) power = share_product<N>(power, power);
    add_normal(sums.facing, windowed(power, i), i);
    power = share_product<N>(power, power);
    add(sums.low, windowed(power, i), t, i);
    add(sums.high, windowed(share_product<N>(power, power), i), t, i);
  }
  return sums;
}

}  // namespace kerf
