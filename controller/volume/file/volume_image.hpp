// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Where the voxels of a volume lie: voxel (i, j, k) has its centre at
/// `origin_mm + direction * (spacing_mm * (i, j, k))` in the frame of the source file; `direction`
/// is a proper rotation (row-major, columns are the voxel axes).
struct VolumeFrame {
  VoxelGrid grid;
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};
};

/// A volume in memory as the scene keeps it: u16 density, x fastest, in its own axes. Load time
/// only.
struct VolumeImage : VolumeFrame {
  std::vector<Density> density;
  std::vector<Label> labels;  ///< empty, or one per voxel
};

}  // namespace kerf
