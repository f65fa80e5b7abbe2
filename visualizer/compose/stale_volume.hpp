// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "visualizer/compose/stale_tiles.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

/// Collects the dirty voxels and triangles of one volume, and tells which tiles of its last picture
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
  void mark(StaleTiles& tiles, const Renderer& renderer, const VolumeView& volume,
            std::span<const Density> density, const View& view, const RenderTarget& kept) const;

 private:
  std::vector<VoxelBox> changed_;        ///< `Renderer::dirty_voxels`
  std::vector<FineTriangle> triangles_;  ///< `Renderer::dirty_triangles`
};

}  // namespace kerf
