// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Voxels along the edge of a brick of the free-space map: a byte for eight voxels.
inline constexpr std::int32_t kFreeBrick = 2;
/// Steps of the map's distances in a voxel.
inline constexpr std::int32_t kFreeSteps = 4;
inline constexpr std::int32_t kFreeFarthest = 254;  ///< the longest distance, steps

/// A sample bears something only where a voxel at most so far from it along each axis reaches the
/// iso: the reach of a closeup, and its cell (docs/theory.md 3.2).
inline constexpr std::int32_t kIsoNear = 3;
/// The same from where a sample reads that voxel, steps of the map: (kIsoNear - 1) sqrt 3.
inline constexpr std::int32_t kIsoNearSteps = 14;
static_assert(kIsoNearSteps * kIsoNearSteps >=
              3 * (kIsoNear - 1) * (kIsoNear - 1) * kFreeSteps * kFreeSteps);

/// Where a volume has nothing that contact could feel (docs/theory.md 2.3). Each brick of voxels
/// has the Euclidean distance, in steps of 1/4 voxel rounded down, from its nearest point to the
/// nearest one where a sample would read a voxel that contact counts (r >= 1/16), or that to a
/// voxel of the iso less kIsoNearSteps where this is farther; at most `kFreeFarthest`. A voxel is
/// read less than one edge away from it on every axis.
///
/// Made at load (controller/plan/tables/free_brick_map.hpp). Cutting only takes density away, so
/// the map is a lower bound for ever and needs no update. Points into the maker's memory.
struct FreeBricks {
  VoxelGrid grid;                          ///< of bricks
  const std::uint8_t* distance = nullptr;  ///< none: nothing is known to be free

  /// Distance of the brick that holds a voxel's cell; outside of the volume, where nothing is read,
  /// that of the nearest brick in it, or the way to it if that is longer. Always inlined: the code
  /// of an instruction set may not end where other machines find it.
  [[nodiscard, gnu::always_inline]] inline std::int32_t at(std::int32_t x, std::int32_t y,
                                                           std::int32_t z) const noexcept {
    if (distance == nullptr) return 0;
    const std::int32_t i = within(x / kFreeBrick, grid.nx), j = within(y / kFreeBrick, grid.ny),
                       k = within(z / kFreeBrick, grid.nz);
    const std::int32_t over_xy = larger(beyond(x, grid.nx), beyond(y, grid.ny));
    return at_least(distance[(std::int64_t{k} * grid.ny + j) * grid.nx + i],
                    larger(over_xy, beyond(z, grid.nz)));
  }

  /// The nearest of so many bricks along an axis.
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
  /// What a brick says, or the way of so many voxels to it.
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

/// Distance that the brick of a sphere's centre needs so that nothing in the sphere reads a voxel
/// with such density. One more than any brick has where the sphere is too large for the map.
[[nodiscard]] constexpr std::uint8_t free_steps_for(double radius_vox) noexcept {
  if (radius_vox * kFreeSteps > kFreeFarthest) return kFreeFarthest + 1;
  const auto steps = static_cast<std::uint8_t>(radius_vox * kFreeSteps);
  return static_cast<std::uint8_t>(steps + (steps < radius_vox * kFreeSteps ? 1 : 0));
}

}  // namespace kerf
