// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Voxels along the edge of a brick of the free-space map. Smaller bricks let queries leave out
/// more samples: of a sliding ball of radius 8 it is 36 %, with bricks of 4 it would be 15 %.
inline constexpr std::int32_t kFreeBrick = 2;

/// Where a volume has nothing that contact could feel (docs/theory.md 2.3). Each brick of voxels
/// has the Chebyshev distance, in bricks, to the nearest one with density that contact counts
/// (r >= 1/16): 0 if it has some itself, at most 255.
///
/// Made at load (controller/plan/tables/free_brick_map.hpp). Cutting only takes density away, so
/// the map is a lower bound for ever and needs no update. Points into the maker's memory.
struct FreeBricks {
  VoxelGrid grid;                          ///< of bricks
  const std::uint8_t* distance = nullptr;  ///< none: nothing is known to be free

  /// Distance of the brick that holds a voxel; a voxel outside of the volume counts as the nearest
  /// one in it, whose distance is no larger. Always inlined: the code of an instruction set may not
  /// end where other machines find it.
  [[nodiscard, gnu::always_inline]] inline std::int32_t at(std::int32_t x, std::int32_t y,
                                                           std::int32_t z) const noexcept {
    if (distance == nullptr) return 0;
    const std::int32_t bx = x < 0 ? 0 : x / kFreeBrick, by = y < 0 ? 0 : y / kFreeBrick,
                       bz = z < 0 ? 0 : z / kFreeBrick;
    const std::int32_t i = bx < grid.nx ? bx : grid.nx - 1, j = by < grid.ny ? by : grid.ny - 1,
                       k = bz < grid.nz ? bz : grid.nz - 1;
    return distance[(std::int64_t{k} * grid.ny + j) * grid.nx + i];
  }
};

/// Distance that a brick needs so that no sample within `radius_vox` of a point in it, on each
/// axis, reads a voxel of a brick with such density. A sample reads the voxel after its own too.
[[nodiscard]] constexpr std::int32_t free_bricks_for(double radius_vox) noexcept {
  std::int32_t bricks = 1;
  while ((bricks - 1) * kFreeBrick < radius_vox + 1) ++bricks;
  return bricks;
}

}  // namespace kerf
