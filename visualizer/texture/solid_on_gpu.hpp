// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "visualizer/gl/program.hpp"
#include "visualizer/texture/voxel_texture.hpp"
#include "visualizer/view/camera.hpp"

namespace kerf {

/// Density and labels of one volume as textures: what solid.frag reads. Uploaded whole
/// once, then by changed bricks.
class SolidOnGpu {
 public:
  /// Throws VisualizerError where the volume is beyond `max_texture_size`.
  SolidOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size);

  /// Uploads bricks `changed` of `density` (the whole volume).
  void update_bricks(std::span<const Density> density, std::span<const std::uint32_t> changed);

  /// See `Renderer::place`.
  void place(const glm::dmat4& world_from_voxel);

  /// Names the units of density (0), labels (1) and `palette` to a program with solid.frag.
  static void set_units(const GlProgram& program, int palette);
  /// Binds the two textures, and sets what such a program must know of the volume in this view.
  void bind(const GlProgram& program, const View& view) const;

  [[nodiscard]] const BrickGrid& bricks() const noexcept { return bricks_; }
  [[nodiscard]] const glm::dmat4& world_from_texture() const noexcept {
    return world_from_texture_;
  }

 private:
  BrickGrid bricks_;
  bool has_labels_;
  float iso_;  ///< 0..1, as the texture reads
  glm::dmat4 world_from_texture_;
  VoxelTexture density_;
  VoxelTexture labels_;
};

/// The palette that solid.frag reads, of these materials.
[[nodiscard]] GlTexture2D palette_texture(std::span<const MaterialView> materials);

}  // namespace kerf
