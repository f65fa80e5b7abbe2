// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Voxels of at least a density that hang together by their faces.
struct SolidPart {
  std::uint64_t voxels = 0;
  VoxelBox box;
};

/// A row's stretch of such voxels, x0 <= x < x1.
struct SolidRun {
  std::int32_t x0, x1, y, z;
  std::uint32_t part;  ///< index of its part
};

/// What is solid, in parts: the largest first. Load time; memory by the number of runs (20 bytes
/// each), not of voxels.
class SolidParts {
 public:
  SolidParts(const VoxelGrid& grid, std::span<const Density> density, Density least);

  [[nodiscard]] std::span<const SolidPart> parts() const { return parts_; }
  /// In the order of the voxels.
  [[nodiscard]] std::span<const SolidRun> runs() const { return runs_; }

 private:
  std::vector<SolidPart> parts_;
  std::vector<SolidRun> runs_;
};

}  // namespace kerf
