// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/tool_pose.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Product of two weights; fixed rounds half up.
template <class N>
[[nodiscard]] constexpr typename N::Weight weight_product(typename N::Weight a,
                                                          typename N::Weight b) noexcept {
  if constexpr (N::kIsFixed) {
    return static_cast<typename N::Weight>(round_shift(std::int64_t{a} * b, 15));
  } else {
    return a * b;
  }
}

/// The cell of eight voxels around a position: its low corner, and how far in the position lies.
template <class N>
struct Cell {
  VoxelIndex low;
  VoxelVec<typename N::Weight> weight;  ///< 0..kWeightOne, both ends possible in fixed

  /// All eight corners are voxels of the volume.
  [[nodiscard]] constexpr bool inside(const VoxelGrid& grid) const noexcept {
    return low.x >= 0 && low.y >= 0 && low.z >= 0 && low.x < grid.nx - 1 && low.y < grid.ny - 1 &&
           low.z < grid.nz - 1;
  }
  /// At least one corner is a voxel of the volume.
  [[nodiscard]] constexpr bool touches(const VoxelGrid& grid) const noexcept {
    return low.x >= -1 && low.y >= -1 && low.z >= -1 && low.x < grid.nx && low.y < grid.ny &&
           low.z < grid.nz;
  }
};

/// The cell of a position within +-kPositionLimitVox. Fixed: weights rounded half up to Q0.15.
template <class N>
[[nodiscard]] constexpr Cell<N> cell_at(VoxelVec<typename N::Real> position) noexcept {
  using Real = typename N::Real;
  using Weight = typename N::Weight;
  Cell<N> cell;
  const auto split = [](Real at, std::int32_t& low, Weight& weight) {
    if constexpr (N::kIsFixed) {
      low = at.raw() >> 16;
      weight = ((at.raw() & 0xffff) + 1) >> 1;
    } else {
      low = static_cast<std::int32_t>(at);
      if (Real(low) > at) --low;
      weight = at - Real(low);
    }
  };
  split(position.x, cell.low.x, cell.weight.x);
  split(position.y, cell.low.y, cell.weight.y);
  split(position.z, cell.low.z, cell.weight.z);
  return cell;
}

/// Eight weights of a cell's corners; corner 4*k + 2*j + i is the voxel `low + (i, j, k)`.
template <class N>
using TrilinearWeights = std::array<typename N::Weight, 8>;

/// Never negative; in fixed the eight add up to kWeightOne exactly, because each split gives one
/// part the rounded product and the other part the rest. Each is within 1.5 steps of its exact
/// value.
template <class N>
[[nodiscard]] constexpr TrilinearWeights<N> trilinear_weights(
    VoxelVec<typename N::Weight> w) noexcept {
  using Weight = typename N::Weight;
  const Weight yz = weight_product<N>(w.y, w.z);
  const std::array<Weight, 4> edge = {N::kWeightOne - w.y - w.z + yz, w.y - yz, w.z - yz, yz};
  TrilinearWeights<N> corner{};
  for (std::size_t q = 0; q < 4; ++q) {
    const Weight far = weight_product<N>(w.x, edge[q]);
    corner[2 * q] = edge[q] - far;
    corner[2 * q + 1] = far;
  }
  return corner;
}

/// a + (b - a) w; fixed rounds half up, |b - a| < 2^47.
template <class N, class Value>
[[nodiscard]] constexpr Value lerp(Value a, Value b, typename N::Weight w) noexcept {
  if constexpr (N::kIsFixed) {
    const std::int64_t difference = std::int64_t{b} - std::int64_t{a};
    return static_cast<Value>(a + round_shift(difference * w, 15));
  } else {
    return a + (b - a) * w;
  }
}

/// Trilinear blend of a cell's corners (order as in TrilinearWeights): along x, then y, then z.
///
/// Corners in fixed are values times kSampleOne, as is the result: the 8 kept bits hold the three
/// roundings to 0.006 of a step; the rounded weights add up to 3 steps over the whole i16 range.
template <class N, class Value = typename N::Sample>
[[nodiscard]] constexpr Value trilinear(const std::array<Value, 8>& corner,
                                        VoxelVec<typename N::Weight> w) noexcept {
  const auto face = [&](std::size_t k) {
    return lerp<N>(lerp<N>(corner[4 * k], corner[4 * k + 1], w.x),
                   lerp<N>(corner[4 * k + 2], corner[4 * k + 3], w.x), w.y);
  };
  return lerp<N>(face(0), face(1), w.z);
}

}  // namespace kerf
