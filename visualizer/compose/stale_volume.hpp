// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "visualizer/compose/stale_tiles.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

/// What has changed in one volume since a picture of it was drawn, and which tiles that leaves
/// stale; the others would come out the same, bit by bit.
class StaleVolume {
 public:
  /// Takes what the last `update` of volume `index` changed: densities in `differs`.
  void add(const Renderer& renderer, std::size_t index, std::span<const VoxelBox> differs);
  void clear();

  /// `density` is all of the volume as it is now; `kept` holds the picture of the opaque
  /// volumes alone, with its depth.
  void mark(StaleTiles& tiles, const Renderer& renderer, const VolumeView& volume,
            std::span<const Density> density, const View& view, const RenderTarget& kept) const;

 private:
  std::vector<VoxelBox> changed_;        ///< `Renderer::looks_different`
  std::vector<FineTriangle> triangles_;  ///< `Renderer::different_triangles`
};

}  // namespace kerf
