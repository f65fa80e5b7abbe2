// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"

// Samples of a tool in a volume: their positions, the voxels around one, the extent of the tool
// inside the solid.

namespace kerf {

/// Offset of a tool voxel from the tool centre in half pitches, so that even and odd grids are both
/// exact: position = offset * pitch / 2.
using ToolOffset = std::array<std::int16_t, 3>;

/// A sum over samples or voxels, one component per voxel axis; never saturates.
template <class N>
using SumVec = VoxelVec<typename N::Sum>;

/// Pose of the tool in one volume: sample i lies at `centre_vox + step * offset_i / 2`, since
/// offsets are in half pitches.
///
/// `step[a][b]` is the displacement along voxel axis a for one pitch along tool axis b: rotation
/// times pitch over spacing, Q11.20 in fixed. Made once per tick and volume.
template <class N>
struct ToolPose {
  VoxelVec<typename N::Real> centre_vox;
  std::array<std::array<typename N::Step, 3>, 3> step{};
};

/// No sample lies farther out than this on any axis. A volume must be smaller, so a sample at the
/// limit is outside every volume.
inline constexpr std::int32_t kPositionLimitVox = 1 << 14;

/// Position of one tool sample. A position beyond the limit, or NaN, becomes the limit.
///
/// Fixed: exact products, one rounding to Q15.16, half up. Floating: x, y, z products in this
/// order.
template <class N>
[[nodiscard]] constexpr VoxelVec<typename N::Real> sample_position(
    const ToolPose<N>& pose, const ToolOffset& offset) noexcept {
  using Real = typename N::Real;
  const auto along = [&](Real centre, const std::array<typename N::Step, 3>& step) {
    if constexpr (N::kIsFixed) {
      constexpr std::int64_t kLimit = std::int64_t{kPositionLimitVox} << Real::kFractionBits;
      const std::int64_t rotated = std::int64_t{step[0]} * offset[0] +
                                   std::int64_t{step[1]} * offset[1] +
                                   std::int64_t{step[2]} * offset[2];
      // 20 fraction bits times half pitches: 21 bits down to 16.
      const std::int64_t place = centre.raw() + round_shift(rotated, 5);
      return Real::from_raw(static_cast<std::int32_t>(place < -kLimit  ? -kLimit
                                                      : place > kLimit ? kLimit
                                                                       : place));
    } else {
      constexpr Real kLimit = Real(kPositionLimitVox);
      const Real rotated =
          step[0] * Real(offset[0]) + step[1] * Real(offset[1]) + step[2] * Real(offset[2]);
      const Real place = centre + rotated * Real(0.5);
      return place > -kLimit ? (place < kLimit ? place : kLimit) : -kLimit;
    }
  };
  return {along(pose.centre_vox.x, pose.step[0]), along(pose.centre_vox.y, pose.step[1]),
          along(pose.centre_vox.z, pose.step[2])};
}

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

/// The cell of eight voxels around a position: its low corner, and the position inside the cell.
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

/// How far the tool reaches into the solid along `normal`: largest minus smallest `position .
/// normal` over the tool samples whose nearest voxel has at least density `iso`; 0 when there is
/// none.
///
/// In voxels for a unit normal. A normal times mm per voxel, axis by axis, gives mm (up to 1.99 mm
/// per voxel in fixed). For a ball that sinks d into a flat: more than d + 1/2 voxel - pitch, at
/// most d + 1/2 voxel, since a sample takes the density of its nearest voxel. For reports and
/// display.
template <class N>
[[nodiscard]] constexpr typename N::Real penetration_extent(
    const VoxelGrid& grid, std::span<const Density> density, std::span<const ToolOffset> offsets,
    const ToolPose<N>& pose, Density iso, VoxelVec<typename N::Unit> normal) noexcept {
  using Real = typename N::Real;
  const auto nearest = [](Real at) {
    if constexpr (N::kIsFixed) {
      return static_cast<std::int32_t>(round_shift(at.raw(), 16));
    } else {
      const Real up = at + Real(0.5);
      const auto whole = static_cast<std::int32_t>(up);
      return Real(whole) > up ? whole - 1 : whole;
    }
  };
  // Along the normal from the tool centre, with 16 fraction bits in fixed.
  const auto along = [&](VoxelVec<Real> at) {
    if constexpr (N::kIsFixed) {
      const auto term = [](Real a, Real centre, typename N::Unit n) {
        return round_shift((std::int64_t{a.raw()} - centre.raw()) * n.raw(), 30);
      };
      return term(at.x, pose.centre_vox.x, normal.x) + term(at.y, pose.centre_vox.y, normal.y) +
             term(at.z, pose.centre_vox.z, normal.z);
    } else {
      return dot(at - pose.centre_vox, normal);
    }
  };
  using Along = decltype(along(pose.centre_vox));
  Along lowest{}, highest{};
  bool found = false;
  for (const ToolOffset& offset : offsets) {
    const VoxelVec<Real> at = sample_position(pose, offset);
    const VoxelIndex v{nearest(at.x), nearest(at.y), nearest(at.z)};
    if (!grid.contains(v) || density[grid.index(v.x, v.y, v.z)] < iso) continue;
    const Along place = along(at);
    lowest = found ? std::min(lowest, place) : place;
    highest = found ? std::max(highest, place) : place;
    found = true;
  }
  if constexpr (N::kIsFixed) {
    return Real::from_raw(saturate_i32(highest - lowest));
  } else {
    return highest - lowest;
  }
}

}  // namespace kerf
