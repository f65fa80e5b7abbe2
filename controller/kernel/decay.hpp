// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

// 1 - exp(-x) for load time: from + - * / alone, so the last bit does not depend on a libm.

/// For x >= 0 by its series; full double precision below 1/4.
[[nodiscard]] constexpr double decay_small(double x) noexcept {
  double term = x, sum = 0;
  for (int n = 2; n < 16; ++n) {
    sum += term;
    term *= -x / n;
  }
  return sum;
}

/// For any x >= 0: within 1e-13.
[[nodiscard]] constexpr double decay(double x) noexcept {
  constexpr int kHalvings = 8;
  constexpr double kWhole = 42.0;  // exp(-x) is below 1e-18
  if (!(x < kWhole)) return 1.0;
  double part = decay_small(x / (1 << kHalvings));
  for (int i = 0; i < kHalvings; ++i) part = part * (2 - part);
  return part;
}

}  // namespace kerf
