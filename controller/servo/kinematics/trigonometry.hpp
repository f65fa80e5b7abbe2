// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/numbers.hpp"

namespace kerf {

/// Of one angle.
template <class N>
struct SineCosine {
  typename N::Unit sine, cosine;
};

/// Sine and cosine by their Taylor series in nested form, for |angle| <= 2 rad (every joint of the
/// devices stays below 1.8). No libm: its last bit differs between versions.
///
/// Truncation: 2^17/17! = 3.7e-10 and 2^18/18! = 4.1e-11; fixed point adds at most 3e-8, which is
/// 4e-6 mm at an arm of 133 mm. Larger angles lose accuracy, never range.
template <class N>
[[nodiscard]] constexpr SineCosine<N> sine_cosine(typename N::Angle angle) noexcept {
  using A = typename N::Angle;
  constexpr int kTerms = 8;
  const A one(1);
  const A square = angle * angle;
  A sine = one;
  A cosine = one;
  // sin x = x (1 - x^2/(2 3) (1 - x^2/(4 5) (...))),  cos x = 1 - x^2/(1 2) (1 - x^2/(3 4) (...))
  for (int k = kTerms; k >= 1; --k) {
    sine = one - square * A(1.0 / ((2 * k) * (2 * k + 1))) * sine;
    cosine = one - square * A(1.0 / ((2 * k - 1) * (2 * k))) * cosine;
  }
  return {typename N::Unit(angle * sine), typename N::Unit(cosine)};
}

}  // namespace kerf
