// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "controller/kernel/point_shell/shell_table.hpp"

namespace kerf {

/// A share of the tool's reach as the shell's tables hold it; fixed: Q0.15.
template <class N>
[[nodiscard]] ShellNumber<N> lever_of(double share) {
  if constexpr (N::kIsFixed) {
    return static_cast<ShellNumber<N>>(std::lround(share * 32768));
  } else {
    return static_cast<ShellNumber<N>>(share);
  }
}

}  // namespace kerf
