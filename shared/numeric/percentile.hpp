// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace kerf {

/// The smallest of `values` that a share (0..1) of them does not exceed, by nearest rank; 0 for
/// nothing. Puts `values` into another order. No NaN.
[[nodiscard]] inline double percentile(std::span<double> values, double share) noexcept {
  if (values.empty()) return 0.0;
  constexpr double kRounding = 1e-9;  // 0.28 * 25 is a hair above 7
  const double rank = std::ceil(share * static_cast<double>(values.size()) - kRounding);
  const std::size_t at = std::min(static_cast<std::size_t>(std::max(rank, 1.0)), values.size()) - 1;
  const auto found = values.begin() + static_cast<std::ptrdiff_t>(at);
  std::nth_element(values.begin(), found, values.end());
  return *found;
}

}  // namespace kerf
