// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "visualizer/gl/gl_objects.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/gradient_plan.hpp"
#include "visualizer/scene/scene_view.hpp"

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

  /// Uploads `box` out of a whole volume's texels, x fastest, which has a border of so many.
  void upload_from(const void* whole, const VoxelBox& box, int border = 0);
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

/// Throws VisualizerError if the volume with its border is beyond `max_texture_size`.
void check_extent(const VolumeView& volume, int max_texture_size);

/// What the translucent renderers read at every sample, ready to be filtered: the gradient of the
/// density and the density itself, 8 bits each.
struct GradientTexel {
  std::uint8_t x, y, z;  ///< 128 + 127 g, g in -1..1
  std::uint8_t density;  ///< 255 = scene maximum

  friend constexpr bool operator==(const GradientTexel&, const GradientTexel&) noexcept = default;
};
inline constexpr GradientTexel kAirTexel{128, 128, 128, 0};

/// Fills `texels` for `box` out of a whole volume: `fill_gradients` and the densities.
void fill_gradient_texels(const GradientPlan& plan, const VoxelGrid& grid,
                          std::span<const Density> density, const VoxelBox& box,
                          std::vector<GradientTexel>& texels);

/// Linear colour of the material and its opacity over `kOpacityMm`, 8 bits each.
struct MaterialTexel {
  std::uint8_t r, g, b, opacity;

  friend constexpr bool operator==(const MaterialTexel&, const MaterialTexel&) noexcept = default;
};

/// The material of each voxel by its label. A voxel without one takes the mean of the labelled
/// voxels within two edges, so that a border which fades into the air keeps its colour; where there
/// are none either, the material of its density.
///
/// Refers to the labels, which do not change.
class MaterialTexels {
 public:
  MaterialTexels(const VoxelGrid& grid, std::span<const Label> labels, const Palette& palette);

  /// Of a brick of a whole volume, or of any box; x fastest.
  [[nodiscard]] std::vector<MaterialTexel> of(const VoxelBox& box,
                                              std::span<const Density> density) const;
  /// Of all of it.
  [[nodiscard]] std::vector<MaterialTexel> of_all(std::span<const Density> density) const;

 private:
  [[nodiscard]] bool any_label(const VoxelBox& box) const;
  [[nodiscard]] std::optional<glm::vec4> mean_around(VoxelIndex at) const;
  /// Calls `put(voxel, texel)` for each voxel of the box.
  template <class Put>
  void each(const VoxelBox& box, std::span<const Density> density, const Put& put) const;

  VoxelGrid grid_;
  std::span<const Label> labels_;
  std::array<glm::vec4, kPaletteWidth> label_materials_;
  std::array<MaterialTexel, kPaletteWidth> by_density_{}, by_label_{};
};

/// Density and labels of one volume as textures: what volume_sample.frag reads. Uploaded whole
/// once, then by changed bricks.
class SolidOnGpu {
 public:
  /// Throws VisualizerError if the volume is beyond `max_texture_size`.
  SolidOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size);

  /// Uploads bricks `changed` of `density` (the whole volume).
  void update_bricks(std::span<const Density> density, const ChangedBricks& changed);

  /// See `Renderer::set_transform`.
  void set_transform(const glm::dmat4& world_from_voxel);

  /// Names the units of density (0), labels (1) and `palette` to a program with volume_sample.frag.
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

/// The palette that volume_sample.frag reads, of these materials.
[[nodiscard]] GlTexture2D palette_texture(std::span<const MaterialView> materials);

}  // namespace kerf
