// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "shared/volume/voxel_grid.hpp"

namespace kerf::test {

/// All voxels of a box or grid, x fastest: `for (const auto& [x, y, z] : voxels(grid))`.
inline std::vector<VoxelIndex> voxels(const VoxelBox& box) {
  std::vector<VoxelIndex> all;
  for_each_voxel(box, [&](auto x, auto y, auto z) { all.push_back({x, y, z}); });
  return all;
}
inline std::vector<VoxelIndex> voxels(const VoxelGrid& grid) {
  return voxels(grid.box());
}

}  // namespace kerf::test
