// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/change_job.hpp"
#include "visualizer/view/sight_reach.hpp"

namespace kerf {

/// Cells of a part of a volume in which a changed voxel matters to a ray. They are as large as
/// voxels and stand on voxels, or between them where the reach is a whole number of edges.
class ChangedCells {
 public:
  /// Around `voxels`, none of them empty, at least one.
  ChangedCells(std::span<const VoxelBox> voxels, const SightReach& reach);

  /// In voxel coordinates.
  [[nodiscard]] const glm::dvec3& low() const noexcept { return low_; }
  [[nodiscard]] glm::dvec3 high() const noexcept;
  /// Fills in what the kernels need of it; good for as long as it lives.
  void put(ChangeJob& job) const;

 private:
  void mark(const VoxelBox& voxels, int reach, std::uint8_t marks);

  VoxelIndex first_;  ///< the lowest voxel
  int reach_;         ///< the larger one
  glm::dvec3 low_;
  VoxelGrid grid_;
  std::vector<std::uint8_t> marks_;
};

}  // namespace kerf
