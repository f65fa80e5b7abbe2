// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// An offset over the tool's reach, as PointTable holds it; fixed: Q0.15.
template <class N>
[[nodiscard]] PointNumber<N> sample_offset(double share) {
  if constexpr (N::kIsFixed) {
    return static_cast<PointNumber<N>>(std::lround(share * 32768));
  } else {
    return static_cast<PointNumber<N>>(share);
  }
}

}  // namespace kerf
