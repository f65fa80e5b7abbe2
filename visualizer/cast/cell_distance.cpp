// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/cell_distance.hpp"

#include <algorithm>
#include <cstdlib>

namespace kerf {

CellDistance::CellDistance(const Macrocells& cells)
    : grid_(cells.grid()), distance_(cells.active().size() + sizeof(std::uint32_t), kFarthest) {
  std::transform(cells.active().begin(), cells.active().end(), distance_.begin(),
                 [](std::uint8_t active) { return active != 0 ? std::uint8_t{0} : kFarthest; });
  // Whatever is outside, the nearest active cell has a face to it.
  for (const auto& [x, y, z, face] : cells.boundary_faces()) lower_around({x, y, z});
}

void CellDistance::update_brick(VoxelIndex at, const Macrocells& cells) {
  const VoxelBox touched = VoxelBox{at, {at.x + 2, at.y + 2, at.z + 2}}.clipped(grid_.box());
  for (std::int32_t z = touched.lo.z; z < touched.hi.z; ++z) {
    for (std::int32_t y = touched.lo.y; y < touched.hi.y; ++y) {
      for (std::int32_t x = touched.lo.x; x < touched.hi.x; ++x) {
        std::uint8_t& distance = distance_[grid_.index(x, y, z)];
        const bool active = cells.active()[grid_.index(x, y, z)] != 0;
        if (active && distance != 0) lower_around({x, y, z});
        if (!active && distance == 0) distance = 1;
      }
    }
  }
}

void CellDistance::lower_around(VoxelIndex cell) {
  const VoxelBox around = VoxelBox{cell, {cell.x + 1, cell.y + 1, cell.z + 1}}
                              .grown(kFarthest - 1)
                              .clipped(grid_.box());
  for (std::int32_t z = around.lo.z; z < around.hi.z; ++z) {
    for (std::int32_t y = around.lo.y; y < around.hi.y; ++y) {
      const std::int32_t away = std::max(std::abs(z - cell.z), std::abs(y - cell.y));
      for (std::int32_t x = around.lo.x; x < around.hi.x; ++x) {
        std::uint8_t& distance = distance_[grid_.index(x, y, z)];
        const std::int32_t here = std::max(away, std::abs(x - cell.x));
        distance = static_cast<std::uint8_t>(std::min<std::int32_t>(distance, here));
      }
    }
  }
}

}  // namespace kerf
