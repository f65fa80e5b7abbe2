// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "controller/kernel/point_shell/point_table.hpp"

namespace kerf {

/// A share of the tool's reach as the shell's tables hold it; fixed: Q0.15.
template <class N>
[[nodiscard]] PointNumber<N> sample_offset(double share) {
  if constexpr (N::kIsFixed) {
    return static_cast<PointNumber<N>>(std::lround(share * 32768));
  } else {
    return static_cast<PointNumber<N>>(share);
  }
}

}  // namespace kerf
