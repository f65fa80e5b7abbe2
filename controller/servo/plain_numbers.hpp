// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

// The loop's numbers as doubles, for the output.

template <class S>
[[nodiscard]] constexpr double as_double(S value) noexcept {
  return static_cast<double>(value);
}

template <class S, class Space>
[[nodiscard]] constexpr std::array<double, 3> as_doubles(Vec<S, Space> v) noexcept {
  return {as_double(v.x), as_double(v.y), as_double(v.z)};
}

template <class S, class Space>
[[nodiscard]] bool all_finite(Vec<S, Space> v) noexcept {
  return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

}  // namespace kerf
