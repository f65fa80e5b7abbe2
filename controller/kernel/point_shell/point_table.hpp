// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/volume/voxel_grid.hpp"

// The point shell of a tool, the density field that it reads, and the map of free space around the
// solid. Plain structs, for kernels of every instruction set.

namespace kerf {

/// Voxels along the edge of a brick of the free-space map: a byte for eight voxels.
inline constexpr std::int32_t kFreeBrick = 2;
/// Steps of the map's distances in a voxel.
inline constexpr std::int32_t kFreeSteps = 4;
inline constexpr std::int32_t kFreeFarthest = 254;  ///< the longest distance, steps

/// A sample bears a load only if a voxel at most so far from it along each axis reaches the
/// iso: the reach of a closeup, and its cell (docs/theory.md 3.2).
inline constexpr std::int32_t kIsoNear = 3;
/// Farthest distance of such a voxel from the sample's own voxel, in steps of the map: sqrt 3
/// times (kIsoNear - 1).
inline constexpr std::int32_t kIsoNearSteps = 14;
static_assert(kIsoNearSteps * kIsoNearSteps >=
              3 * (kIsoNear - 1) * (kIsoNear - 1) * kFreeSteps * kFreeSteps);

/// The map of free space of a volume (docs/theory.md 2.3). Each brick of voxels
/// has the Euclidean distance, in steps of 1/4 voxel rounded down, from its nearest point to the
/// nearest position where a sample reads a voxel that contact counts (r >= 1/16), or the distance
/// to a voxel of the iso less kIsoNearSteps if that is farther; at most `kFreeFarthest`. A voxel is
/// read less than one edge away from it on every axis.
///
/// Made at load (controller/plan/tables/free_brick_map.hpp). Cutting only takes density away, so
/// the map stays a lower bound and needs no update. Points into the maker's memory.
struct FreeSpaceMap {
  VoxelGrid grid;                          ///< of bricks
  const std::uint8_t* distance = nullptr;  ///< none: nothing is known to be free

  /// Distance of the brick that holds a voxel's cell. Outside of the volume no voxel is read:
  /// there, the distance of the nearest brick, or the distance to that brick if it is longer.
  /// Always inlined: the linker must not share code of an instruction set with other files.
  [[nodiscard, gnu::always_inline]] inline std::int32_t at(std::int32_t x, std::int32_t y,
                                                           std::int32_t z) const noexcept {
    if (distance == nullptr) return 0;
    const std::int32_t i = within(x / kFreeBrick, grid.nx), j = within(y / kFreeBrick, grid.ny),
                       k = within(z / kFreeBrick, grid.nz);
    const std::int32_t over_xy = larger(beyond(x, grid.nx), beyond(y, grid.ny));
    return at_least(distance[(std::int64_t{k} * grid.ny + j) * grid.nx + i],
                    larger(over_xy, beyond(z, grid.nz)));
  }

  /// The number of the nearest brick along an axis of so many bricks.
  [[nodiscard, gnu::always_inline]] static inline std::int32_t within(
      std::int32_t brick, std::int32_t bricks) noexcept {
    const std::int32_t below = brick < bricks ? brick : bricks - 1;
    return larger(below, 0);
  }
  /// Voxels from a cell to the nearest one that is read, along an axis of so many bricks.
  [[nodiscard, gnu::always_inline]] static inline std::int32_t beyond(
      std::int32_t cell, std::int32_t bricks) noexcept {
    return larger(-cell - 1, cell - bricks * kFreeBrick + 1);
  }
  /// The distance of a brick, or the distance of so many voxels to it if that is longer.
  [[nodiscard, gnu::always_inline]] static inline std::int32_t at_least(
      std::int32_t inside, std::int32_t voxels) noexcept {
    const std::int32_t outside = kFreeSteps * voxels;
    return larger(inside, outside < kFreeFarthest ? outside : kFreeFarthest);
  }
  [[nodiscard, gnu::always_inline]] static inline std::int32_t larger(std::int32_t a,
                                                                      std::int32_t b) noexcept {
    return a > b ? a : b;
  }
};

/// Distance that the brick of a sphere's centre needs so that no position in the sphere reads such
/// a voxel. If the sphere is too large for the map, one more than any brick has.
[[nodiscard]] constexpr std::uint8_t free_steps_for(double radius_vox) noexcept {
  if (radius_vox * kFreeSteps > kFreeFarthest) return kFreeFarthest + 1;
  const auto steps = static_cast<std::uint8_t>(radius_vox * kFreeSteps);
  return static_cast<std::uint8_t>(steps + (steps < radius_vox * kFreeSteps ? 1 : 0));
}

// The point shell: samples on the surface of a tool, at which contact reads the density
// (docs/theory.md 3.1).

/// A number of these kernels. In fixed it is a plain integer; each use states its format.
template <class N>
using PointNumber = typename N::Weight;

inline constexpr std::int32_t kPointGroup = 16;        ///< samples that lie together
inline constexpr std::int32_t kMaxShellPoints = 8192;  ///< sums then fit 53 bits

/// A tool's samples, axis by axis in the tool's axes, padded to whole groups. Made at load
/// (controller/plan/tables/point_shell_table.hpp); points into the maker's memory.
template <class N>
struct PointTable {
  const PointNumber<N>* offset[3] = {};  ///< from the tool's centre, over its reach; Q0.15
  const PointNumber<N>* middle[3] = {};  ///< of each group, from the centre, over the reach; Q0.15
  const std::uint8_t* needed = nullptr;  ///< `free_steps_for` each group
  /// `free_steps_for` the whole tool about its centre, and for one sample.
  std::uint8_t needed_whole = kFreeFarthest + 1, needed_sample = kFreeFarthest + 1;
  std::int32_t count = 0;  ///< of samples
  std::int32_t groups = 0;
  bool round = false;      ///< a ball: the offset is the normal
  PointNumber<N> reach{};  ///< no offset of a sample is longer; voxels, Q15.16
};

/// Takes offsets to voxels of one volume: offset_vox_i = (SUM_k row[i][k] offset[k]) 2^-shift in
/// Q15.16, rounded half up. Floating point has no shift.
///
/// Range in fixed: |row[i]| <= 65000 and |offset| <= 2^15, but for their roundings, so no sum
/// leaves 31 bits. A ball's caps have offsets of up to 1.42 * 2^15; their rows are at most 53248,
/// made so that no result is above 1.04 radii.
template <class N>
struct PointStep {
  PointNumber<N> row[3][3] = {};
  std::int32_t shift = 1;
};

/// Offset of padding: beyond every volume, wherever the tool is near one; voxels.
inline constexpr std::int32_t kNoSampleVox = 1 << 14;

/// The samples of a rotated tool in the voxels of one volume; Q15.16. Arrays are as long as the
/// table's.
template <class N>
struct PointPositions {
  PointNumber<N>* offset_vox[3] = {};  ///< of the samples from the centre
  PointNumber<N>* middle[3] = {};      ///< of the groups
};

/// Position of a sample or a group: `centre` + `offset`. In fixed it saturates, outside of every
/// volume.
template <class N>
[[nodiscard]] constexpr PointNumber<N> place_at(PointNumber<N> centre,
                                                PointNumber<N> offset) noexcept {
  if constexpr (N::kIsFixed) {
    return saturate_i32(std::int64_t{centre} + offset);
  } else {
    return centre + offset;
  }
}

/// Takes densities to those of contact, in which the iso-surface is at 1/2 (docs/theory.md 2.1):
/// density / 2 * mantissa * 2^-shift, in steps of 2^-15. `mantissa` has 16 bits.
struct DensityScale {
  std::uint32_t mantissa = 32768;
  std::int32_t shift = 15;  ///< 0..16
};

/// An iso of 0 counts as 1.
[[nodiscard]] constexpr DensityScale density_scale(Density iso) noexcept {
  const std::uint64_t level = iso == 0 ? 1 : iso;
  DensityScale scale{0, -1};
  while (scale.mantissa < 32768) {
    const std::uint64_t whole = std::uint64_t{32768} << ++scale.shift;
    scale.mantissa = static_cast<std::uint32_t>((whole + level / 2) / level);
  }
  return scale;
}

template <class S>
[[nodiscard]] constexpr S scale_factor(const DensityScale& scale) noexcept {
  return S(scale.mantissa) / S(std::int32_t{1} << scale.shift);
}

/// The density of one volume as the point shell reads it; `density` changes as material is cut.
struct DensityField {
  VoxelGrid grid;
  const Density* density = nullptr;
  DensityScale scale;
  FreeSpaceMap free{};  ///< of this volume (plan/tables/free_brick_map.hpp)
};

/// Sums over the samples of one query (docs/theory.md 3.2, 3.3). r is the density of contact and w
/// = r^p, p = 4 for balls and 6 for other shapes. Two more weights are derived from w:
///
///   w_g  of gradients: w; for balls 3 w - w / r, half the derivative of their peak at the iso,
///        times SUM w
///   w_x  of offsets: w; for balls w r. Trilinear values are too high at the edge of the density,
///        in bands with a normal near an axis of the voxels; with w this would tilt the normal of
///        a ball
///
/// In fixed r is Q15, weights are Q24, gradients are in the volume's densities over 2, offsets in
/// Q0.15. All sums are exact, |sum| < 2^53, so no order and no instruction set matters.
template <class N>
struct PointSums {
  typename N::Sum weight{};          ///< SUM w
  typename N::Sum density{};         ///< SUM w r
  typename N::Sum square{};          ///< SUM w r^2, r^2 in Q16
  typename N::Sum gradient[3] = {};  ///< SUM w_g grad, voxel axes
  typename N::Sum offset[3] = {};    ///< SUM w_x offset
  typename N::Sum high{};            ///< SUM w r^2, which weights `high_offset`; 0 for balls
  typename N::Sum high_offset[3] = {};
  PointNumber<N> top{};         ///< the largest r
  std::int32_t top_sample = 0;  ///< the last sample that has it
  std::int32_t read = 0;        ///< samples that were read, by whole groups
};

/// Radius of a closeup around a contact, units. With 2 the force of a cylinder over a sharp edge
/// steps by 9 % of its mean, not 4 (rows `edges`).
inline constexpr std::int32_t kCloseRadius = 3;
inline constexpr double kClosePitch = 0.35;      ///< units between them
inline constexpr std::int32_t kMostClose = 448;  ///< that a closeup reads; some 330 on a flat
inline constexpr std::int32_t kMostInCell = 32;

/// The surface of a tool in close samples: the rim or the point of a tool on a sharp edge touches
/// in less than the spacing of the samples of the point shell.
///
/// Sorted by cells of one unit, x fastest. Made at load
/// (controller/plan/tables/point_shell_table.hpp); points into the maker's memory. A ball has none.
template <class N>
struct CloseTable {
  const PointNumber<N>* offset[3] = {};  ///< from the tool's centre, over its reach; Q0.15
  const PointNumber<N>* normal[3] = {};  ///< of the tool's surface, outward; Q0.15, 0 on rims
  const std::int32_t* first = nullptr;   ///< sample of each cell, then the end; null: none
  std::int32_t cells[3] = {};            ///< along the axes
  PointNumber<N> low[3] = {};            ///< offset of the first cell's lower corner
  PointNumber<N> edge{};                 ///< of a cell: a unit over the reach
};

}  // namespace kerf
