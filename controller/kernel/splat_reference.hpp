// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/aligned_reference.hpp"

namespace kerf {

// The method `splat` by its definition. Its modification sum is `exact_modification_sum`, overlap
// and removal are those of overlap.hpp and milling.hpp. Fixed point only.

/// SUM over samples i of SUM over the corners c of its cell of w_ic times the exact gradient, in
/// density steps per voxel times 2^(15 - sum_shift) * 2^shift / factor. Nothing is rounded but the
/// weights, and the sum once.
/// Density outside the volume is 0; `gradient_at` is `gradient_exact` or a cache of it.
template <class GradientAt>
[[nodiscard]] constexpr SumVec<FixedNumbers> splat_contact_sum(
    GradientAt&& gradient_at, std::span<const ToolOffset> offsets,
    const ToolPose<FixedNumbers>& pose) noexcept {
  const int shift = sum_shift(offsets.size());
  WideSumVec sum;
  for (const ToolOffset& offset : offsets) {
    const auto cell = cell_at<FixedNumbers>(sample_position(pose, offset));
    const auto weights = trilinear_weights<FixedNumbers>(cell.weight);
    for (std::size_t c = 0; c < 8; ++c) {
      const auto bit = [&](std::size_t axis) { return static_cast<std::int32_t>(c >> axis & 1); };
      sum.add(std::int64_t{weights[c]} *
                  gradient_at(
                      VoxelIndex{cell.low.x + bit(0), cell.low.y + bit(1), cell.low.z + bit(2)}),
              shift);
    }
  }
  return sum.over(shift);
}

}  // namespace kerf
