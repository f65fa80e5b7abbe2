// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Turns an exact sum of weighted gradients (voxel axes; docs/theory.md 7) into a force at the
/// device port (N): one matrix that holds pressure, sample volume, voxel size, rotation and
/// workspace scale.
///
/// Floating point: a plain matrix.
template <class N>
struct SumToForce {
  std::array<std::array<typename N::Real, 3>, 3> row{};
};

/// Fixed point: F = SUM_k mantissa[i][k] * (sum[k] >> pre_shift) >> post_shift, in Q15.16 N.
///
/// `pre_shift` is chosen at load so that the largest possible sum keeps 38 bits; with 22-bit
/// mantissas three products stay below 2^62. The sum itself is never cut: it saturates once, here.
template <>
struct SumToForce<FixedNumbers> {
  std::array<std::array<std::int32_t, 3>, 3> mantissa{};
  int pre_shift = 0;
  int post_shift = 0;
};

template <class N>
[[nodiscard]] constexpr DeviceVec<typename N::Real> force_of_sum(
    const SumToForce<N>& map, Vec<typename N::Sum, VoxelSpace> sum) noexcept {
  using Real = typename N::Real;
  if constexpr (N::kIsFixed) {
    constexpr std::int64_t kLimit = std::int64_t{1} << 38;
    const auto reduced = [&](std::int64_t s) {
      return std::clamp(round_shift(s, map.pre_shift), -kLimit, kLimit);
    };
    const std::array<std::int64_t, 3> s{reduced(sum.x), reduced(sum.y), reduced(sum.z)};
    const auto component = [&](std::size_t i) {
      const auto& m = map.mantissa[i];
      const std::int64_t wide = m[0] * s[0] + m[1] * s[1] + m[2] * s[2];
      return Real::from_raw(saturate_i32(round_shift(wide, map.post_shift)));
    };
    return {component(0), component(1), component(2)};
  } else {
    const auto component = [&](std::size_t i) {
      const auto& m = map.row[i];
      return m[0] * sum.x + m[1] * sum.y + m[2] * sum.z;
    };
    return {component(0), component(1), component(2)};
  }
}

}  // namespace kerf
