// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/free_brick_map.hpp"

#include <algorithm>

namespace kerf {
namespace {

constexpr std::uint8_t kFarthest = 255;

/// Chebyshev distance to the nearest 0 by two sweeps over 13 neighbours each (Rosenfeld and Pfaltz
/// 1968): exact for this distance.
void spread(const VoxelGrid& grid, std::vector<std::uint8_t>& distance) {
  const auto sweep = [&](std::int32_t step) {
    const auto count = static_cast<std::int32_t>(grid.voxel_count());
    for (std::int32_t n = 0; n < count; ++n) {
      const std::int32_t i = step > 0 ? n : count - 1 - n;
      const VoxelIndex at{i % grid.nx, i / grid.nx % grid.ny, i / grid.nx / grid.ny};
      std::uint8_t& here = distance[static_cast<std::size_t>(i)];
      // The neighbours that this sweep has met.
      for (std::int32_t c = 0; c < 13; ++c) {
        const VoxelIndex near{at.x + step * (c % 3 - 1), at.y + step * (c / 3 % 3 - 1),
                              at.z + step * (c / 9 - 1)};
        if (!grid.contains(near)) continue;
        const std::uint8_t there = distance[grid.index(near.x, near.y, near.z)];
        here = std::min<std::uint8_t>(here, there == kFarthest ? there : there + 1);
      }
    }
  };
  sweep(1);
  sweep(-1);
}

}  // namespace

FreeBrickMap::FreeBrickMap(const VoxelGrid& grid, std::span<const Density> density,
                           Density faintest)
    : grid_{(grid.nx + kFreeBrick - 1) / kFreeBrick, (grid.ny + kFreeBrick - 1) / kFreeBrick,
            (grid.nz + kFreeBrick - 1) / kFreeBrick},
      distance_(grid_.voxel_count(), kFarthest) {
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      const Density* row = density.data() + grid.index(0, y, z);
      std::uint8_t* bricks = distance_.data() + grid_.index(0, y / kFreeBrick, z / kFreeBrick);
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        if (row[x] >= faintest) bricks[x / kFreeBrick] = 0;
      }
    }
  }
  spread(grid_, distance_);
}

}  // namespace kerf
