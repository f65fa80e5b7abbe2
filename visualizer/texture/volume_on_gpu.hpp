// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "visualizer/texture/cells_on_gpu.hpp"
#include "visualizer/texture/solid_on_gpu.hpp"

namespace kerf {

/// One volume for `iso`: what it is made of, its macrocells, and the gradient where it spans too
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

  /// Binds what `SolidOnGpu` binds, active cells on unit 2 and the gradient on 3.
  void bind(const GlProgram& program, const View& view) const;

  [[nodiscard]] const CellsOnGpu& cells() const noexcept { return cells_; }

 private:
  SolidOnGpu solid_;
  CellsOnGpu cells_;

  using GradientTexel = std::array<std::int16_t, 4>;  ///< 32767 as 1; the last is nothing
  void upload_gradient(std::span<const Density> density, const VoxelBox& box);
  std::optional<VoxelTexture> gradient_;
  std::vector<glm::vec3> gradients_;  ///< of the last upload
  std::vector<GradientTexel> texels_;
};

}  // namespace kerf
