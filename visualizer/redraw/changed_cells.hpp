// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/gradient_rows.hpp"
#include "visualizer/redraw/redraw_tiles.hpp"

namespace kerf {

/// A grid of marks around the changed voxels of a volume: these voxels, dilated by the footprint of
/// a ray. A ray that crosses no marked cell has the same colour as before.
///
/// A cell is as large as a voxel. Its centre is a voxel if the footprint is odd, and a corner
/// between voxels if it is even.
class ChangedCells {
 public:
  /// `voxels`: at least one box, none of them empty.
  ChangedCells(std::span<const VoxelBox> voxels, const RayFootprint& footprint);

  /// The lowest and the highest corner of the grid, in voxel coordinates.
  [[nodiscard]] const glm::dvec3& low() const noexcept { return low_; }
  [[nodiscard]] glm::dvec3 high() const noexcept;
  /// Puts the grid into a job, which points into this object.
  void put(RedrawJob& job) const;

 private:
  void mark(const VoxelBox& voxels, int reach, std::uint8_t marks);

  VoxelIndex first_;  ///< the lowest changed voxel
  int reach_;         ///< the larger of the footprint's two, in half voxel edges
  glm::dvec3 low_;
  VoxelGrid grid_;
  std::vector<std::uint8_t> marks_;
};

/// Marks the tiles with a ray whose footprint holds a voxel of `changed`; all other tiles would be
/// drawn with the same bits again. `end_at_kept`: rays end at the depth of the kept picture, as
/// those of opaque volumes do. `shading`: gradients by which the surfaces are shaded where rays
/// end, as they are now; null if their shading samples nothing along their normals. None of the
/// boxes is empty.
void mark_rays(std::span<const VoxelBox> changed, const RayFootprint& footprint, bool end_at_kept,
               const GradientRows* shading, const KeptPicture& kept, RedrawTiles& tiles);

}  // namespace kerf
