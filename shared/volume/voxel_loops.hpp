// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Calls `take(x, y, z)` for each voxel of a box in the order of memory: x fastest, then y.
template <class Take>
constexpr void for_each_voxel(const VoxelBox& box, const Take& take) {
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) take(x, y, z);
    }
  }
}

}  // namespace kerf
