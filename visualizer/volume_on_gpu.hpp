// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "visualizer/cells_on_gpu.hpp"
#include "visualizer/voxel_texture.hpp"

namespace kerf {

/// What a renderer draws of a volume at this moment; spans of the caller, x fastest.
struct VolumeContent {
  std::span<const Density> density;
  std::span<const Label> labels;  ///< empty, or one per voxel
};

/// Density, labels and macrocells of one volume as textures, and the gradient where it spans too
/// many voxels for a shader to work it out: 8 bytes a voxel. Whole once, then bricks only.
class VolumeOnGpu {
 public:
  /// `skip_empty` false takes every cell for active: the slow obvious picture, for comparison.
  /// Throws VisualizerError where the volume is beyond `max_texture_size`.
  VolumeOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size,
              bool skip_empty, Gradient gradient = Gradient::corners);

  /// Uploads bricks `changed` of `density` (the whole volume) and the cells they touch.
  void update_bricks(std::span<const Density> density, std::span<const std::uint32_t> changed);

  /// See `Renderer::place`.
  void place(const glm::dmat4& world_from_voxel);

  /// Density on unit 0, labels on 1, active cells on 2, gradient on 3.
  void bind_textures() const;

  [[nodiscard]] bool has_labels() const noexcept { return has_labels_; }
  [[nodiscard]] float iso() const noexcept { return iso_; }  ///< 0..1, as the texture reads
  [[nodiscard]] glm::dvec3 texels() const noexcept { return texels_of(bricks_.grid); }
  [[nodiscard]] const glm::dmat4& world_from_texture() const noexcept {
    return world_from_texture_;
  }
  [[nodiscard]] const CellsOnGpu& cells() const noexcept { return cells_; }

 private:
  BrickGrid bricks_;
  bool has_labels_;
  float iso_;
  glm::dmat4 world_from_texture_;
  VoxelTexture density_;
  VoxelTexture labels_;
  CellsOnGpu cells_;

  using GradientTexel = std::array<std::int16_t, 4>;  ///< 32767 as 1; the last is nothing
  void upload_gradient(std::span<const Density> density, const VoxelBox& box);
  std::optional<VoxelTexture> gradient_;
  std::vector<glm::vec3> gradients_;  ///< of the last upload
  std::vector<GradientTexel> texels_;
};

}  // namespace kerf
