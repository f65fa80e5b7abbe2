// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/kernel/trilinear.hpp"

namespace kerf {

/// SUM over tool samples i of SUM over the corners j of its cell of phi_ij grad_j: the interpolated
/// gradients added up, in density steps per voxel times kWeightOne. The paper's contact force is
/// minus this, scaled by p0 a^3 (docs/theory.md 7.1).
///
/// A sample whose cell is not wholly inside the volume counts nothing. `field` holds one gradient
/// per voxel. Fixed: nothing is rounded but the weights, so the order of samples does not matter;
/// 2^30 per sample leaves room for 2^33 samples. Floating: samples in their order.
template <class N>
[[nodiscard]] constexpr SumVec<N> contact_sum(const VoxelGrid& grid,
                                              std::span<const Gradient<N>> field,
                                              std::span<const ToolOffset> offsets,
                                              const ToolPose<N>& pose) noexcept {
  using Sum = typename N::Sum;
  SumVec<N> sum{};
  for (const ToolOffset& offset : offsets) {
    const Cell<N> cell = cell_at<N>(sample_position(pose, offset));
    if (!cell.inside(grid)) continue;
    const TrilinearWeights<N> weights = trilinear_weights<N>(cell.weight);
    for (std::size_t edge = 0; edge < 4; ++edge) {
      const auto j = static_cast<std::int32_t>(edge & 1);
      const auto k = static_cast<std::int32_t>(edge >> 1);
      const std::size_t at = grid.index(cell.low.x, cell.low.y + j, cell.low.z + k);
      for (std::size_t i = 0; i < 2; ++i) {
        const Gradient<N>& g = field[at + i];
        const auto w = static_cast<Sum>(weights[2 * edge + i]);
        sum.x += w * static_cast<Sum>(g.x);
        sum.y += w * static_cast<Sum>(g.y);
        sum.z += w * static_cast<Sum>(g.z);
      }
    }
  }
  return sum;
}

}  // namespace kerf
