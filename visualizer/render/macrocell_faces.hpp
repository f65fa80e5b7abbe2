// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "visualizer/cast/macrocells.hpp"
#include "visualizer/gl/gl_objects.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// `Macrocells::boundary_faces` in a list that changes little when cells do, so that a copy
/// of it elsewhere follows by a few pieces.
class CellFaces {
 public:
  using Face = std::array<std::uint16_t, 4>;
  /// Slots first <= i < end.
  struct Run {
    std::size_t first, end;
  };

  explicit CellFaces(const Macrocells& cells);

  /// Call after cells in `flipped` became active or inactive. Returns the slots whose face
  /// changed, ascending; slots from the list's size on are gone.
  std::vector<Run> update(const Macrocells& cells, const VoxelBox& flipped);

  [[nodiscard]] std::span<const Face> all() const noexcept { return faces_; }
  /// The list of a grid is no longer: all walls of its cells. A bar of active cells has four of
  /// five of them, and where active and empty cells take turns, nearly all are faces too.
  [[nodiscard]] static std::size_t most(const VoxelGrid& grid) noexcept {
    const auto [nx, ny, nz] = grid;
    return 3 * grid.voxel_count() + VoxelGrid{nx, ny, 1}.voxel_count() +
           VoxelGrid{nx, 1, nz}.voxel_count() + VoxelGrid{1, ny, nz}.voxel_count();
  }
  /// In cells, the smallest box that holds every active one.
  [[nodiscard]] VoxelBox active_box() const;

 private:
  std::vector<Face> faces_;
};

/// The macrocells of one volume as a texture, `Macrocells::active`; whole once, then only what
/// changed.
class CellTexture {
 public:
  /// Cells of `edge` voxel edges that hold a density of at least `threshold` are active.
  CellTexture(const BrickGrid& bricks, std::span<const Density> density, Density threshold,
              std::int32_t edge = Macrocells::kEdge);

  /// Bricks `changed` of `density` (the whole volume) differ. As `Macrocells::update_bricks`.
  VoxelBox update_bricks(std::span<const Density> density, const ChangedBricks& changed);

  void bind(GLuint unit) const { glBindTextureUnit(unit, texture_.id()); }
  [[nodiscard]] const Macrocells& cells() const noexcept { return cells_; }

 private:
  void upload(const VoxelBox& cells);

  BrickGrid bricks_;
  Macrocells cells_;
  GlTexture3D texture_ = GlTexture3D::create();
};

/// The macrocells of one volume on the GPU: which are active, and the faces around those; whole
/// once, then only what changed.
class CellsOnGpu {
 public:
  /// Cells that hold a density of at least `threshold` are active.
  CellsOnGpu(const VolumeView& volume, std::span<const Density> density, Density threshold);

  /// Bricks `changed` of `density` (the whole volume) differ.
  void update_bricks(std::span<const Density> density, const ChangedBricks& changed);

  /// See `Renderer::set_transform`.
  void set_transform(const glm::dmat4& world_from_voxel);

  /// The texture: not 0 in active cells.
  void bind(GLuint unit) const { cells_.bind(unit); }
  /// Draws the faces around the active cells with the program in use; attribute 0 is a face.
  void draw_faces() const;

  [[nodiscard]] const glm::dmat4& world_from_cell() const noexcept { return world_from_cell_; }
  /// In cells, the smallest box that holds every active one.
  [[nodiscard]] const VoxelBox& active_box() const noexcept { return active_box_; }

 private:
  void upload_faces(std::span<const CellFaces::Run> runs);

  glm::dmat4 world_from_cell_{1.0};
  CellTexture cells_;
  CellFaces faces_;
  VoxelBox active_box_;
  GlBuffer face_buffer_ = GlBuffer::create();
  GlVertexArray face_array_ = GlVertexArray::create();
};

/// Per pixel, where its ray first meets an active macrocell of a volume, in mm along the view axis:
/// drawn from the faces between active and empty cells. The far plane if it meets none, the near
/// plane if it begins in one. One layer for each volume.
class RayEntries {
 public:
  explicit RayEntries(int layers) : layers_(layers) {}

  /// Draws `layer` within the bounds of `target`'s parts. Leaves its own framebuffer bound, the
  /// depth test on and nothing culled.
  void draw(int layer, const CellsOnGpu& cells, const View& view, const RenderTarget& target);
  /// The layers as a texture array.
  void bind(GLuint unit) const { glBindTextureUnit(unit, buffer_->entry_mm.id()); }

 private:
  struct Buffer {
    Buffer(PictureSize size, int layers);
    PictureSize size;
    GlTexture2DArray entry_mm = GlTexture2DArray::create();
    GlTexture2D depth = GlTexture2D::create();
    GlFramebuffer framebuffer = GlFramebuffer::create();
  };

  int layers_;
  GlProgram program_{"cell_faces.vert", "cell_faces.frag"};
  std::optional<Buffer> buffer_;
};

}  // namespace kerf
