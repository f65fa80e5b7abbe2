// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "visualizer/gl/names.hpp"
#include "visualizer/macrocells.hpp"
#include "visualizer/scene_view.hpp"

namespace kerf {

/// What a renderer draws of a volume at this moment; spans of the caller, x fastest.
struct VolumeContent {
  std::span<const Density> density;
  std::span<const Label> labels;  ///< empty, or one per voxel
};

/// Density, labels and macrocells of one volume as textures; whole once, then bricks only.
///
/// Each texture has a shell of air one voxel thick, so voxel v has texel coordinate v + 1.5: the
/// iso-surface closes at the volume's border, and no border colour is needed.
class VolumeOnGpu {
 public:
  /// `skip_empty` false takes every cell for active: the slow obvious picture, for comparison.
  /// Throws VisualizerError where the volume is beyond `max_texture_size`.
  VolumeOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size,
              bool skip_empty);

  /// Uploads bricks `changed` of `density` (the whole volume) and the cells they touch.
  void update_bricks(std::span<const Density> density, std::span<const std::uint32_t> changed);

  /// Density on unit 0, labels on 1, active cells on 2.
  void bind_textures() const;
  /// Draws the faces around the active cells with the program in use; attribute 0 is a face.
  void draw_cell_faces() const;

  [[nodiscard]] bool has_labels() const noexcept { return has_labels_; }
  [[nodiscard]] float iso() const noexcept { return iso_; }  ///< 0..1, as the texture reads
  [[nodiscard]] glm::dvec3 texels() const noexcept { return texels_; }
  [[nodiscard]] const glm::dmat4& world_from_texture() const noexcept {
    return world_from_texture_;
  }
  [[nodiscard]] const glm::dmat4& world_from_cell() const noexcept { return world_from_cell_; }

 private:
  void upload_cells();

  BrickGrid bricks_;
  bool has_labels_;
  float iso_;
  glm::dvec3 texels_;
  glm::dmat4 world_from_texture_;
  glm::dmat4 world_from_cell_;
  Macrocells cells_;
  GlTexture3D density_ = GlTexture3D::create();
  GlTexture3D labels_ = GlTexture3D::create();
  GlTexture3D active_ = GlTexture3D::create();
  GlBuffer faces_ = GlBuffer::create();
  GlVertexArray face_array_ = GlVertexArray::create();
  GLsizei face_count_ = 0;
};

}  // namespace kerf
