// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// -F . d: the work that the hand does against F along d, in mJ. Exact in fixed, where Q16 times
/// Q16 has 32 fraction bits; saturates at 2^31 mJ.
template <class N>
[[nodiscard]] constexpr typename N::Energy work_of_hand(
    DeviceVec<typename N::Real> force_n, DeviceVec<typename N::Real> moved_mm) noexcept {
  if constexpr (N::kIsFixed) {
    const auto term = [](Q16 f, Q16 d) { return -(std::int64_t{f.raw()} * d.raw()); };
    return saturating_add(saturating_add(term(force_n.x, moved_mm.x), term(force_n.y, moved_mm.y)),
                          term(force_n.z, moved_mm.z));
  } else {
    return -dot(force_n, moved_mm);
  }
}

/// a + b, saturating in fixed.
template <class N>
[[nodiscard]] constexpr typename N::Energy sum_of_energy(typename N::Energy a,
                                                         typename N::Energy b) noexcept {
  if constexpr (N::kIsFixed) {
    return saturating_add(a, b);
  } else {
    return a + b;
  }
}

/// a - b, likewise.
template <class N>
[[nodiscard]] constexpr typename N::Energy difference_of_energy(typename N::Energy a,
                                                                typename N::Energy b) noexcept {
  if constexpr (N::kIsFixed) {
    return saturating_add(a, b == INT64_MIN ? INT64_MAX : -b);
  } else {
    return a - b;
  }
}

}  // namespace kerf
