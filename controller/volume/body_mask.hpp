// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// Where the largest thick body of a scan lies, in cells of voxels. A couch, a head rest or clothes
/// are plates: they go when a layer of cells is taken off, and with them what hangs on them. Then
/// the largest part is what was scanned; it gets that layer back, and two more to be sure.
class BodyMask {
 public:
  /// `skin`: density from which a cell is no air.
  BodyMask(const VolumeImage& image, Density skin);

  [[nodiscard]] bool contains(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return cells_[grid_.index(x / edge_, y / edge_, z / edge_)] != 0;
  }
  /// Edge of a cell, in voxels: from a multiple of it on, so many along x are all inside or all
  /// out.
  [[nodiscard]] std::int32_t edge() const { return edge_; }

 private:
  std::int32_t edge_;
  VoxelGrid grid_;
  std::vector<Density> cells_;  ///< not 0: inside
};

}  // namespace kerf
