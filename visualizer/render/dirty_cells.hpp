// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/dirty_job.hpp"

namespace kerf {

/// A grid of marks around the dirty voxels of a volume: the dirty voxels, dilated by the footprint
/// of a ray. A ray that crosses no marked cell has the same colour as before.
///
/// A cell is as large as a voxel. Its centre is a voxel where the footprint is odd, and a corner
/// between voxels where it is even.
class DirtyCells {
 public:
  /// `voxels`: at least one box, none of them empty.
  DirtyCells(std::span<const VoxelBox> voxels, const RayFootprint& footprint);

  /// The lowest and the highest corner of the grid, in voxel coordinates.
  [[nodiscard]] const glm::dvec3& low() const noexcept { return low_; }
  [[nodiscard]] glm::dvec3 high() const noexcept;
  /// Puts the grid into a job, which points into this object.
  void put(DirtyJob& job) const;

 private:
  void mark(const VoxelBox& voxels, int reach, std::uint8_t marks);

  VoxelIndex first_;  ///< the lowest dirty voxel
  int reach_;         ///< the larger of the footprint's two, in half voxel edges
  glm::dvec3 low_;
  VoxelGrid grid_;
  std::vector<std::uint8_t> marks_;
};

}  // namespace kerf
