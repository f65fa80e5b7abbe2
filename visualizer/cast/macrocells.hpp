// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume/changed_bricks.hpp"
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

/// Which cells of e^3 voxel edges have a density of iso or more, so that rays pass over those that
/// cannot hold the iso-surface; and which octants of these do.
///
/// Air surrounds the volume: its surface is closed at the border too. Cell (i, j, k) spans voxel
/// coordinates ei-1 to ei+e-1 on each axis with both ends, so its highest density bounds every
/// trilinear sample in the cell. Its octants have e/2 voxel edges; the octants of cells of two are
/// the cells of eight voxels in which a trilinear sample lies. A changed brick (voxels 8b to
/// 8b+7) touches cells 8b/e to 8(b+1)/e.
class Macrocells {
 public:
  static constexpr std::int32_t kEdge = 8;

  /// `edge` is even and divides that of a brick.
  Macrocells(VoxelGrid volume, std::span<const Density> density, Density iso,
             std::int32_t edge = kEdge);

  /// Computes again the cells that touch bricks of `changed`. Returns the smallest box around the
  /// cells of which an octant became active or inactive.
  VoxelBox update_bricks(const BrickGrid& bricks, const ChangedBricks& changed,
                         std::span<const Density> density);

  [[nodiscard]] const VoxelGrid& grid() const noexcept { return grid_; }
  /// 0 if no sample reaches iso; else bit x + 2y + 4z of each octant (0 or 1 along each axis) in
  /// which one may.
  [[nodiscard]] std::span<const std::uint8_t> active() const noexcept { return active_; }

  /// Faces between an active cell and an inactive one or the outside, `{x, y, z, face}` with face
  /// 2*axis + (1 when on the high side): where a ray enters or leaves what it must sample.
  [[nodiscard]] std::vector<std::array<std::uint16_t, 4>> boundary_faces() const {
    return boundary_faces(grid_.box());
  }
  /// The faces around the active cells in a box within `grid()`.
  [[nodiscard]] std::vector<std::array<std::uint16_t, 4>> boundary_faces(
      const VoxelBox& cells) const;

 private:
  bool update_cell(VoxelIndex cell, std::span<const Density> density);

  VoxelGrid volume_;
  std::int32_t edge_;
  VoxelGrid grid_;
  Density iso_;
  std::vector<std::uint8_t> active_;
};

/// Where the rays of each block of pixels can meet the active cells of a volume: the picture of the
/// cells, coarse and on the safe side. Rays of a block without cells cost nothing, the others begin
/// and end near what they may see; between the two, the cells themselves are read.
class MacrocellDepthRange {
 public:
  using Cell = std::array<std::uint16_t, 3>;

  /// For a part of a picture of `width` x `height` seen through `view`. `cells` are the active ones
  /// that have a face to an empty one or to the outside: a ray enters and leaves what is active
  /// through them. Where rays may `begin_inside`, all begin at the near plane.
  void draw(std::span<const Cell> cells, bool begin_inside, const glm::dmat4& world_from_cell,
            const View& view, std::int32_t width, std::int32_t height, const PixelRect& part);

  /// `CastVolumeJob::blocks`; those beside the part are left over from other ones.
  [[nodiscard]] const CastBlock* data() const noexcept { return blocks_.data(); }

 private:
  void cover(const glm::dvec2& low, const glm::dvec2& high, const CastBlock& range);

  std::int32_t across_ = 0;
  PixelRect drawn_;  ///< blocks of the part
  std::vector<CastBlock> blocks_;
};

}  // namespace kerf
