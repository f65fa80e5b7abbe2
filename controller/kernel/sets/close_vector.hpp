// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/close_sums.hpp"
#include "controller/kernel/sets/point_vector.hpp"

// Sums of close samples for AVX2 and AVX-512, in the bits of close_sums.hpp; `Simd` as in
// box_vector.hpp. Each sample fills a 32-bit lane.

namespace kerf {
namespace {

/// Of 64-bit entries.
struct PowerVectors {
  V weight = Simd::zero(), density = Simd::zero();
  V offset[3] = {Simd::zero(), Simd::zero(), Simd::zero()};

  [[gnu::always_inline]] void add(V power, V t, const V (&at)[3]) noexcept {
    const PointWeights weights(power);
    weights.count(weight);
    weights.add(density, t);
    for (std::size_t axis = 0; axis < 3; ++axis) weights.add(offset[axis], at[axis]);
  }
  [[nodiscard]] PowerSums<FixedNumbers> sums() const noexcept {
    return {Simd::sum64(weight),
            Simd::sum64(density),
            {Simd::sum64(offset[0]), Simd::sum64(offset[1]), Simd::sum64(offset[2])}};
  }
};

/// Of 64-bit entries.
struct NormalVectors {
  V weight = Simd::zero();
  V normal[3] = {Simd::zero(), Simd::zero(), Simd::zero()};

  [[gnu::always_inline]] void add(V power, const V (&at)[3]) noexcept {
    const PointWeights weights(power);
    weights.count(weight);
    for (std::size_t axis = 0; axis < 3; ++axis) weights.add(normal[axis], at[axis]);
  }
  [[nodiscard]] NormalSums<FixedNumbers> sums() const noexcept {
    return {Simd::sum64(weight),
            {Simd::sum64(normal[0]), Simd::sum64(normal[1]), Simd::sum64(normal[2])}};
  }
};

void sum_close_samples(const CloseLook<FixedNumbers>& look,
                       CloseSums<FixedNumbers>& sums) noexcept {
  sums = {};
  V top = Simd::zero();
  const auto product = [](V a, V b) {
    return Simd::srl32<15>(Simd::add32(Simd::multiply32(a, b), Simd::set32(1 << 14)));
  };
  const auto over = Simd::set32(over_radius(look)), least = Simd::set32(-look.radius),
             most = Simd::set32(look.radius), one = Simd::set32(1 << 15);
  for (std::int32_t i = 0; i < look.count; i += kPointLanes) {
    V rest = one;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const V from = Simd::sub32(Simd::load(look.offset[axis] + i), Simd::set32(look.middle[axis]));
      const V along = Simd::min32(Simd::max32(from, least), most);
      const V share = Simd::sra32<15>(Simd::multiply32(along, over));
      rest = Simd::sub32(rest, product(share, share));
    }
    rest = Simd::max32(rest, Simd::zero());
    const V window = product(rest, rest);
    Simd::store(look.window + i, window);
    // A sample that does not count has density 0 here.
    const V counts = Simd::min32(Simd::multiply32(window, one), Simd::load(look.density + i));
    top = Simd::max32(top, counts);
  }
  sums.top = highest32(top);
  if (sums.top < kFaintest<FixedNumbers>) return;
  const auto over_top =
      Simd::set32(static_cast<std::int32_t>((1U << 31) / static_cast<std::uint32_t>(sums.top)));
  const auto square = [product](V t) { return product(t, t); };
  const auto load = [](const std::int32_t* const(&of)[3], std::int32_t i, V(&to)[3]) {
    for (std::size_t axis = 0; axis < 3; ++axis) to[axis] = Simd::load(of[axis] + i);
  };
  NormalVectors facing;
  PowerVectors low, high;
  for (std::int32_t i = 0; i < look.count; i += kPointLanes) {
    const V t = Simd::srl32<16>(Simd::multiply32(Simd::load(look.density + i), over_top));
    const V window = Simd::load(look.window + i);
    V power = t, normal[3], offset[3];
    load(look.normal, i, normal);
    load(look.offset, i, offset);
    for (int p = 1; p < CloseSums<FixedNumbers>::kNormalPower; p *= 2) power = square(power);
    facing.add(product(power, window), normal);
    power = square(power);
    low.add(product(power, window), t, offset);
    high.add(product(square(power), window), t, offset);
  }
  sums.facing = facing.sums();
  sums.low = low.sums();
  sums.high = high.sums();
}

}  // namespace
}  // namespace kerf
