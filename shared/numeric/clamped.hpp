// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>

#include "shared/numeric/vec.hpp"

namespace kerf {

/// Shortens `v` to at most `length`, keeping its direction. A shorter vector is returned as it is.
template <std::floating_point S, class Space>
[[nodiscard]] inline Vec<S, Space> clamped(Vec<S, Space> v, S length) noexcept {
  const S current = norm(v);
  return current <= length ? v : v * (length / current);
}
/// Fixed: `norm` rounds down and so do the products here, so the result is never longer.
template <int F, class Space>
[[nodiscard]] constexpr Vec<Fixed<F>, Space> clamped(Vec<Fixed<F>, Space> v,
                                                     Fixed<F> length) noexcept {
  const Fixed<F> current = norm(v);
  if (current < length) return v;
  const std::int64_t above = std::int64_t{current.raw()} + 1;
  const auto shortened = [&](Fixed<F> component) {
    return Fixed<F>::from_raw(saturate_i32(std::int64_t{component.raw()} * length.raw() / above));
  };
  return {shortened(v.x), shortened(v.y), shortened(v.z)};
}

}  // namespace kerf
