// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "visualizer/cast/gradient_rows.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/render/macrocell_faces.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/volume_textures.hpp"

namespace kerf {

/// One volume for `iso`: what it is made of, its macrocells and its gradient. Uploaded whole once,
/// then by changed bricks.
class VolumeOnGpu {
 public:
  /// `skip_empty` false takes every cell for active: the slow obvious picture, for comparison.
  /// Throws VisualizerError if the volume is beyond `max_texture_size`.
  VolumeOnGpu(const VolumeView& volume, const VolumeContent& content, int max_texture_size,
              bool skip_empty, GradientFilter gradient);

  /// Uploads bricks `changed` of `density` (the whole volume) and the cells they touch.
  void update_bricks(std::span<const Density> density, const ChangedBricks& changed);

  /// See `Renderer::set_transform`.
  void set_transform(const glm::dmat4& world_from_voxel);

  /// Binds what `SolidOnGpu` binds, active cells on unit 2, fine cells on 3 and the gradient on 4.
  void bind(const GlProgram& program, const View& view) const;

  [[nodiscard]] const CellsOnGpu& cells() const noexcept { return cells_; }
  [[nodiscard]] const GradientRows& gradient() const noexcept { return gradient_; }

 private:
  glm::vec3 edges_mm_;  ///< of a voxel
  SolidOnGpu solid_;
  CellsOnGpu cells_;
  CellTexture fine_cells_;  ///< of two voxel edges: their octants are the cells of eight voxels
  GradientRows gradient_;
  VoxelTexture gradient_texture_;
};

/// Iso-surfaces by ray casting in a fragment shader.
///
/// Per volume two passes. The first draws the faces between active and empty macrocells and keeps,
/// per pixel, where its ray first meets an active cell; the second casts the ray from there, into
/// each cell of eight voxels that may hold the surface (iso.frag). So pixels beside the volume cost
/// nothing, and no part of the surface is too thin to be met.
class IsoRenderer final : public Renderer {
 public:
  struct Options {
    bool skip_empty = true;  ///< false: look into all cells on a ray, for comparison
    std::string_view light = "lighting.frag";  ///< or normals.frag, for measurements
  };

  IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents)
      : IsoRenderer(scene, contents, Options{.light = light_of(scene)}) {}
  IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents, Options options);

  void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) override {
    volumes_[volume].set_transform(world_from_voxel);
  }
  void draw(const View& view, const RenderTarget& target) override;

 private:
  void upload(std::size_t volume, std::span<const Density> density,
              const ChangedBricks& changed) override {
    volumes_[volume].update_bricks(density, changed);
  }
  [[nodiscard]] const GradientRows* surface_gradient(std::size_t volume) const override {
    return &volumes_[volume].gradient();
  }
  void cast_rays(const VolumeOnGpu& volume, const View& view, const RenderTarget& target);

  GlProgram cast_program_;
  GlTexture2D palette_;
  std::vector<VolumeOnGpu> volumes_;
  RayEntries entries_{1};
};

}  // namespace kerf
