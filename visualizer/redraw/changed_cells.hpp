// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/redraw/redraw_tiles.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

/// A grid of marks around the dirty voxels of a volume: the dirty voxels, dilated by the footprint
/// of a ray. A ray that crosses no marked cell has the same colour as before.
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

  VoxelIndex first_;  ///< the lowest dirty voxel
  int reach_;         ///< the larger of the footprint's two, in half voxel edges
  glm::dvec3 low_;
  VoxelGrid grid_;
  std::vector<std::uint8_t> marks_;
};

/// Collects the dirty voxels and triangles of one volume, and marks which tiles of its last picture
/// they make stale. All other tiles would be drawn with the same bits again.
///
/// Call `add` after each update of the renderer, `mark` before a picture, `clear` after it.
class StaleVolume {
 public:
  /// Takes what the renderer's last `update` of volume `index` made dirty. `differs` holds every
  /// voxel whose density changed.
  void add(const Renderer& renderer, std::size_t index, std::span<const VoxelBox> differs);
  void clear();

  /// Marks the stale tiles of `kept`, the last picture of the opaque volumes with its depth.
  /// `density` is all of the volume, as it is now.
  void mark(RedrawTiles& tiles, const Renderer& renderer, const VolumeView& volume,
            std::span<const Density> density, const View& view, const RenderTarget& kept) const;

 private:
  std::vector<VoxelBox> changed_;        ///< `Renderer::dirty_voxels`
  std::vector<FineTriangle> triangles_;  ///< `Renderer::dirty_triangles`
};

}  // namespace kerf
