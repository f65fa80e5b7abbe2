// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "controller/volume/file/volume_image.hpp"
#include "shared/volume/voxel_grid.hpp"

// Connected parts of the solid voxels, and the body of a scan without its couch.

namespace kerf {

/// Voxels of at least a density that are connected by their faces.
struct SolidPart {
  std::uint64_t voxels = 0;
  VoxelBox box;
};

/// A run of such voxels in a row, x0 <= x < x1.
struct SolidRun {
  std::int32_t x0, x1, y, z;
  std::uint32_t part;  ///< index of its part
};

/// The parts of the solid voxels, the largest first. Load time; memory by the number of runs (20
/// bytes each), not of voxels.
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

/// The largest thick body of a scan, in cells of voxels. A couch, a head rest or clothes are
/// plates: they vanish when a layer of cells is removed, and so do parts that hang on them. The
/// largest remaining part is the body; it gets that layer back, and two more to be sure.
class BodyMask {
 public:
  /// `skin`: density from which a cell is no air.
  BodyMask(const VolumeImage& image, Density skin);

  [[nodiscard]] bool contains(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return cells_[grid_.index(x / edge_, y / edge_, z / edge_)] != 0;
  }
  /// Edge of a cell, in voxels: from a multiple of it on, so many along x are all inside or all
  /// outside.
  [[nodiscard]] std::int32_t edge() const { return edge_; }

 private:
  std::int32_t edge_;
  VoxelGrid grid_;
  std::vector<Density> cells_;  ///< not 0: inside
};

}  // namespace kerf
