// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

#include "shared/numeric/numbers.hpp"

namespace kerf {

// The removal budget of a force in one tick, and its distribution. A voxel at full density holds
// 65535 density steps of material.

/// Density steps that may leave; fixed: 24 fraction bits, below 2^53, so that the force of a
/// resting hand at 8 kHz still differs from a millionth more.
template <class N>
using CutBudget = typename N::Sum;

/// Sums of the weights that share a budget. Fixed: density steps with 15 fraction bits; 2^18 voxels
/// of full density stay below 2^49.
template <class N>
using CutWeight = std::conditional_t<N::kIsFixed, std::uint64_t, typename N::Sum>;

inline constexpr int kBudgetBits = 24;
inline constexpr std::int64_t kMaxBudget = std::int64_t{1} << 52;  ///< 4096 full voxels in a tick

/// Density steps that one newton removes in one tick at the reference speed.
template <class N>
struct ForceRate {
  typename N::Sum steps_per_n{};

  friend constexpr bool operator==(const ForceRate&, const ForceRate&) = default;
};
/// Fixed: mantissa 2^-exponent, the mantissa with 31 bits.
template <>
struct ForceRate<FixedNumbers> {
  std::uint32_t mantissa = 0;
  int exponent = 0;  ///< 0..62

  friend constexpr bool operator==(const ForceRate&, const ForceRate&) = default;
};

/// Negative, NaN or below 2^-31 steps per newton removes nothing; more than 2^31 counts as that.
/// Load time.
template <class N>
[[nodiscard]] constexpr ForceRate<N> force_rate(double steps_per_n) noexcept {
  if (!(steps_per_n > 0)) return {};
  if constexpr (N::kIsFixed) {
    constexpr double kTop = 2147483648.0;
    ForceRate<N> rate;
    double mantissa = std::min(steps_per_n, kTop - 1);
    while (mantissa < kTop / 2 && rate.exponent < 62) {
      mantissa *= 2;
      ++rate.exponent;
    }
    rate.mantissa = static_cast<std::uint32_t>(mantissa + 0.5);
    return rate;
  } else {
    return {static_cast<typename N::Sum>(steps_per_n)};
  }
}

/// What a drive (cut_law.hpp) removes in one tick.
template <class N>
[[nodiscard]] constexpr CutBudget<N> budget_of(const ForceRate<N>& rate,
                                               typename N::Sum drive) noexcept {
  if constexpr (N::kIsFixed) {  // 31 bits times 31 bits
    return std::min(round_shift(drive * rate.mantissa, rate.exponent), kMaxBudget);
  } else {
    return rate.steps_per_n * drive;
  }
}

/// part / whole for 0 <= part <= whole, whole > 0. Fixed: 30 fraction bits, within 2^-30, cut off
/// below; equal numbers give exactly 1.
template <class N>
[[nodiscard]] constexpr auto fraction_of(CutWeight<N> part, CutWeight<N> whole) noexcept {
  if constexpr (N::kIsFixed) {
    const int spare = std::max(0, static_cast<int>(std::bit_width(whole)) - 33);
    // The 33 highest bits of a number above 0 are not 0.
    const auto low = whole >> spare;  // NOLINTNEXTLINE(clang-analyzer-core.DivideZero)
    return static_cast<std::int64_t>(((part >> spare) << 30) / low);
  } else {
    return part / whole;
  }
}

/// part / whole as a number of the loop.
template <class N>
[[nodiscard]] constexpr typename N::Unit unit_fraction_of(CutWeight<N> part,
                                                          CutWeight<N> whole) noexcept {
  const auto share = fraction_of<N>(part, whole);
  if constexpr (N::kIsFixed) {
    return N::Unit::from_raw(static_cast<std::int32_t>(share));
  } else {
    return share;
  }
}

/// budget times a `fraction_of`; fixed: rounded down.
template <class N>
[[nodiscard]] constexpr CutBudget<N> portion(CutBudget<N> budget, CutBudget<N> share) noexcept {
  if constexpr (N::kIsFixed) {  // 2^52 times 2^30 in two halves
    constexpr std::int64_t kLow = (std::int64_t{1} << 30) - 1;
    return (budget >> 30) * share + ((budget & kLow) * share >> 30);
  } else {
    return budget * share;
  }
}

/// A budget by weight: a voxel of weight w loses w times budget over the sum of weights.
///
/// Fixed: mantissa 2^-shift with 31 bits or more, truncated; the balance of the tick contains the
/// remainder, so nothing is lost.
template <class N>
class BudgetPerWeight {
 public:
  using Steps = CutWeight<N>;  ///< density steps; fixed: 16 fraction bits

  constexpr BudgetPerWeight() noexcept = default;

  /// Nothing for a budget that is not positive.
  constexpr BudgetPerWeight(CutBudget<N> budget, CutWeight<N> weight) noexcept {
    if (!(budget > 0) || !(weight > 0)) return;
    if constexpr (N::kIsFixed) {
      const auto wide = static_cast<std::uint64_t>(budget);
      const int up = std::countl_zero(wide) - 1;
      const int down = std::max(0, static_cast<int>(std::bit_width(weight)) - 32);
      const std::uint64_t quotient = (wide << up) / (weight >> down);  // at least 2^30
      const int cut = std::max(0, static_cast<int>(std::bit_width(quotient)) - 32);
      const int shift = up + down - cut + kBudgetBits - 15 - 1;  // to 16 fraction bits from 24 - 15
      // A shift that would be negative means far more than any voxel holds.
      mantissa_ = shift < 0 ? 0xffff'ffff : quotient >> cut;
      shift_ = std::clamp(shift, 0, 63);
    } else {
      mantissa_ = budget / weight;
    }
  }

  [[nodiscard]] constexpr CutWeight<N> mantissa() const noexcept { return mantissa_; }
  [[nodiscard]] constexpr int shift() const noexcept { return shift_; }

  /// `weight` below 2^31 in fixed.
  [[nodiscard]] constexpr Steps of(CutWeight<N> weight) const noexcept {
    if constexpr (N::kIsFixed) {
      return weight * mantissa_ >> shift_;
    } else {
      return weight * mantissa_;
    }
  }

 private:
  CutWeight<N> mantissa_{};
  int shift_ = 0;
};

}  // namespace kerf
