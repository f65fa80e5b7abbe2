// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/render/macrocell_faces.hpp"
#include "visualizer/render/volume_textures.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

/// One volume for the renderers that look into it: gradient and density in one texture, materials
/// in a second if there are labels, and the cells that hold something to see.
class TranslucentVolume {
 public:
  TranslucentVolume(const VolumeView& volume, const VolumeContent& content,
                    const TransferFunction& transfer, GradientFilter gradient, int max_texture_size,
                    bool skip_empty);

  /// Uploads bricks `changed` of `density` (the whole volume), gradients around them included. The
  /// labels are those of the last `set_materials`.
  void update_bricks(std::span<const Density> density, const ChangedBricks& changed);

  /// See `Renderer::set_transform`.
  void set_transform(const glm::dmat4& world_from_voxel);

  /// Three units from `unit` on: voxels, materials, active cells.
  void bind_textures(GLuint unit) const;

  /// Uploads the materials again if there are labels.
  void set_materials(const Palette& materials, const VolumeContent& content);

  [[nodiscard]] bool has_labels() const noexcept { return has_labels_; }
  [[nodiscard]] const TransferFunction& transfer() const noexcept { return transfer_; }
  [[nodiscard]] glm::dvec3 texels() const noexcept { return texels_of(bricks_.grid); }
  [[nodiscard]] const glm::dmat4& world_from_texture() const noexcept {
    return world_from_texture_;
  }
  /// The shortest edge of a voxel.
  [[nodiscard]] double edge_mm() const noexcept { return edge_mm_; }
  [[nodiscard]] const GradientPlan& gradient() const noexcept { return gradient_; }
  [[nodiscard]] const CellsOnGpu& cells() const noexcept { return cells_; }

 private:
  void upload(std::span<const Density> density, const VoxelBox& box);

  BrickGrid bricks_;
  bool has_labels_;
  TransferFunction transfer_;
  GradientPlan gradient_;
  glm::dmat4 world_from_texture_;
  double edge_mm_;
  VoxelTexture voxels_;
  VoxelTexture materials_;
  std::optional<MaterialTexels> material_texels_;  ///< if there are labels
  CellsOnGpu cells_;
  std::vector<GradientTexel> upload_buffer_;
};

/// All volumes of a scene as translucent_sample.frag sees them.
class TranslucentVolumes {
 public:
  static constexpr GLuint kUnitsPerVolume = 3;

  /// `skip_empty` false takes every cell for active, for comparison. Throws VisualizerError if a
  /// volume is beyond the driver's limits, or if there are more volumes than it has texture
  /// units for.
  TranslucentVolumes(const SceneView& scene, std::span<const VolumeContent> contents,
                     bool skip_empty);

  /// See `Renderer::set_opacities`.
  void set_opacities(std::span<const MaterialView> materials,
                     std::span<const VolumeContent> contents);

  /// Definitions for the shaders of the volumes that there are: KERF_VOLUMES, KERF_EACH_VOLUME(f),
  /// KERF_HAS_LABELS.
  [[nodiscard]] std::string defines() const;
  /// The first texture unit that is free beside those of the volumes.
  [[nodiscard]] GLuint free_unit() const noexcept;
  /// Samplers and all that does not change with the view.
  void set_constants(const GlProgram& program) const;
  /// Matrices of `view`, and binds the textures.
  void bind(const GlProgram& program, const View& view) const;

  [[nodiscard]] std::span<TranslucentVolume> volumes() noexcept { return volumes_; }
  /// Shortest voxel edge of all volumes, in mm.
  [[nodiscard]] double edge_mm() const noexcept;

 private:
  void upload_materials(std::size_t volume);

  std::vector<TranslucentVolume> volumes_;
  GlTexture2D by_density_ = GlTexture2D::create();  ///< row v: materials of volume v
};

/// Where translucent things gather before they go over a picture: light in linear numbers, which a
/// sum of hundreds of faint samples needs, and the window depth of the nearest that is seen. So the
/// picture's own depth can be read meanwhile, and rays end at what is opaque.
class TranslucentLayer {
 public:
  /// Makes the empty layer the place to draw, with two outputs: colour times opacity, and depth (1
  /// where nothing is seen). No depth test; blending is off. Only the parts of `target` are
  /// emptied, and their bounds are the scissor.
  void begin(const RenderTarget& target);
  /// Puts the layer over `target`: colour blended as sRGB, as meshes are, and depth. A pixel whose
  /// depth is not before the target's stays as it is.
  void finish(const RenderTarget& target);

 private:
  struct Buffer {
    explicit Buffer(PictureSize size);
    PictureSize size;
    GlTexture2D colour = GlTexture2D::create();
    GlTexture2D depth = GlTexture2D::create();
    GlFramebuffer framebuffer = GlFramebuffer::create();
  };

  GlProgram program_{"screen.vert", "composite.frag", "lighting.frag"};
  std::optional<Buffer> buffer_;
};

}  // namespace kerf
