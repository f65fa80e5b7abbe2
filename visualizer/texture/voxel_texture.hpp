// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/gl/names.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// How texels are kept and how they come.
struct TexelFormat {
  GLenum internal;
  GLenum format;
  GLenum type;
  GLenum filter;
};

inline constexpr int kBorder = 1;  ///< voxels of air around a volume

/// One value per voxel as a 3D texture inside a border of air one voxel thick, so voxel v has texel
/// coordinate v + 1.5: surfaces close at the volume's border, and no border colour is needed.
class VoxelTexture {
 public:
  /// Filled with `air`, a texel of the format; null for zeros.
  VoxelTexture(const VoxelGrid& grid, TexelFormat format, const void* air = nullptr);

  /// Uploads `box` out of a whole volume's texels, x fastest.
  void upload_from(const void* whole, const VoxelBox& box);
  /// Uploads texels that fill `box`, x fastest.
  void upload(const void* texels, const VoxelBox& box);

  void bind(GLuint unit) const { glBindTextureUnit(unit, texture_.id()); }

 private:
  VoxelGrid grid_;
  TexelFormat format_;
  GlTexture3D texture_ = GlTexture3D::create();
};

/// Calls `take` for one layer of bricks of a grid after the other: what is worked out for an upload
/// stays small.
template <class Take>
void for_each_layer(const VoxelGrid& grid, const Take& take) {
  for (std::int32_t z = 0; z < grid.nz; z += kBrickEdge) {
    take(VoxelBox{{0, 0, z}, {grid.nx, grid.ny, z + kBrickEdge}}.clipped(grid.box()));
  }
}

/// Extent of a voxel texture in texels.
[[nodiscard]] glm::dvec3 texels_of(const VoxelGrid& grid);
/// From texture coordinates (0..1) to world mm.
[[nodiscard]] glm::dmat4 world_from_texture(const glm::dmat4& world_from_voxel,
                                            const VoxelGrid& grid);

/// Throws VisualizerError where the volume with its border is beyond `max_texture_size`.
void check_extent(const VolumeView& volume, int max_texture_size);

}  // namespace kerf
