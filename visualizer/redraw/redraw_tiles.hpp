// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/gradient_rows.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/pixel_rect.hpp"
#include "visualizer/scene/scene_view.hpp"
#include "visualizer/surface/volume_samples.hpp"

namespace kerf {

/// The damage of a picture: the tiles that must be drawn again. A tile has 4x4 pixels, as the ray
/// caster and a software GL shade them. Rows count from the bottom up, as GL has them.
class RedrawTiles {
 public:
  static constexpr int kEdge = 4;

  explicit RedrawTiles(PictureSize size);

  /// The tiles that `pixels` touch, as a rectangle in tiles; clipped to the picture.
  [[nodiscard]] PixelRect tiles_of(const PixelRect& pixels) const;
  /// The pixels of `tiles`, clipped to the picture.
  [[nodiscard]] PixelRect pixels_of(const PixelRect& tiles) const;

  /// Marks every tile that `pixels` touch.
  void mark(const PixelRect& pixels);
  void mark(int x, int y) { marked_[at(x, y)] = 1; }
  /// Marks what is marked in `other`, which has the same size.
  void mark(const RedrawTiles& other);
  void clear();
  /// The marked tiles that are, or are not, marked in `other`, which has the same size.
  [[nodiscard]] RedrawTiles common(const RedrawTiles& other) const;
  [[nodiscard]] RedrawTiles without(const RedrawTiles& other) const;
  /// Takes tiles out, from the lowest row upwards, until they have `pixels` or more; none if that
  /// is not positive.
  [[nodiscard]] RedrawTiles take(double pixels);
  /// Of the marked tiles, those at the border of the picture counted as whole ones.
  [[nodiscard]] double pixels() const;
  [[nodiscard]] bool empty() const;
  [[nodiscard]] bool marked(int x, int y) const { return marked_[at(x, y)] != 0; }

  /// Rectangles of pixels that do not overlap and cover the marked tiles. Each costs a draw call,
  /// so a rectangle takes in a few clean tiles if that saves another rectangle.
  [[nodiscard]] std::vector<PixelRect> rects() const;

 private:
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(across_) +
           static_cast<std::size_t>(x);
  }

  PictureSize size_;
  int across_, along_;
  std::vector<std::uint8_t> marked_;
};

/// The last picture, and one of its volumes: the input of a redraw.
struct KeptPicture {
  const VolumeView& volume;
  const View& view;            ///< of the last picture and of the next
  const RenderTarget& target;  ///< opaque volumes of the last picture, with their depth
};

/// Marks the tiles in which one of `triangles`, old or new, may cover the centre of a pixel. A tile
/// stays as it is if the depth of `kept` is everywhere nearer than the triangle. Marks a little
/// more than needed, never less: a GPU rounds.
void mark_triangles(std::span<const FineTriangle> triangles, const KeptPicture& kept,
                    RedrawTiles& tiles);

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
  void mark(const VoxelBox& voxels, const int (&reach)[3], std::uint8_t marks);

  VoxelIndex first_;  ///< the lowest changed voxel
  int reach_[3];      ///< the larger of the footprint's two, in half voxel edges
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
