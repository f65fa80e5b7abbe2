// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "controller/kernel/decay.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

/// What one tick removes of a voxel with overlap c (docs/theory.md 7.5): the fraction c *
/// min(1, kT), or 1 - exp(-c kT) in the exact form, whose result after a given time does not depend
/// on the rate.
///
/// Fixed: the fraction at c = 1 is `mantissa` 2^-(15 + exponent). The exact form bends c by a table
/// of f(c) / f(1) with linear steps between 257 entries: within (kT)^2 / (8 * 256^2) / f(1) and two
/// weight steps, never falling. Made at load time by `removal_rate`.
template <class N>
struct RemovalRate {
  static constexpr std::size_t kSteps = 256;

  typename N::Weight mantissa{};  ///< fixed: 16384..32768, or 0 for nothing; floating: the fraction
  int exponent = 0;               ///< fixed: 0..32; floating: 0
  bool bent = false;
  std::array<typename N::Weight, kSteps + 1> bend{};
};

namespace detail {

/// A weight from 0..1, rounded.
template <class N>
[[nodiscard]] constexpr typename N::Weight weight_from(double fraction) noexcept {
  if constexpr (N::kIsFixed) {
    return static_cast<typename N::Weight>(fraction * N::kWeightOne + 0.5);
  } else {
    return static_cast<typename N::Weight>(fraction);
  }
}

}  // namespace detail

/// Above this exp(-kT) is below 1e-13 of a density step: more changes nothing.
inline constexpr double kMaxRateTimesTick = 42.0;

/// `k_times_t` is rate times tick; up to 2^-33, negative or NaN removes nothing. Load time.
template <class N>
[[nodiscard]] constexpr RemovalRate<N> removal_rate(double k_times_t,
                                                    bool exact_exponential) noexcept {
  using Rate = RemovalRate<N>;
  Rate rate;
  if (!(k_times_t > 0)) return rate;
  double fraction = k_times_t < 1 ? k_times_t : 1;
  if (exact_exponential) {
    const double kt = k_times_t < kMaxRateTimesTick ? k_times_t : kMaxRateTimesTick;
    const double step = decay_small(kt / double(Rate::kSteps));
    std::array<double, Rate::kSteps + 1> decay{};
    for (std::size_t i = 0; i < Rate::kSteps; ++i) decay[i + 1] = decay[i] + (1 - decay[i]) * step;
    fraction = decay[Rate::kSteps];
    rate.bent = true;
    for (std::size_t i = 0; i <= Rate::kSteps; ++i) {
      rate.bend[i] = detail::weight_from<N>(decay[i] / fraction);
    }
  }
  if constexpr (N::kIsFixed) {
    while (fraction <= 0.5 && rate.exponent < 32) {
      fraction *= 2;
      ++rate.exponent;
    }
    rate.mantissa = fraction > 0.5 ? detail::weight_from<N>(fraction) : 0;
  } else {
    rate.mantissa = detail::weight_from<N>(fraction);
  }
  return rate;
}

/// The overlap ratio after the bend of the exact form; 0 stays 0 and kWeightOne stays itself.
template <class N>
[[nodiscard]] constexpr typename N::Weight bent_ratio(const RemovalRate<N>& rate,
                                                      typename N::Weight ratio) noexcept {
  using Weight = typename N::Weight;
  if (!rate.bent) return ratio;
  if constexpr (N::kIsFixed) {
    const auto i = static_cast<std::size_t>(ratio >> 7);  // 2^15 in 256 steps of 2^7
    if (i >= rate.kSteps) return rate.bend[rate.kSteps];
    const Weight rise = rate.bend[i + 1] - rate.bend[i];
    return rate.bend[i] + ((rise * (ratio & 127) + 64) >> 7);
  } else {
    const Weight place = ratio * Weight(rate.kSteps);
    const auto i = static_cast<std::size_t>(place);
    if (i >= rate.kSteps) return rate.bend[rate.kSteps];
    return rate.bend[i] + (rate.bend[i + 1] - rate.bend[i]) * (place - Weight(i));
  }
}

}  // namespace kerf
