// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "visualizer/gl/program.hpp"
#include "visualizer/render/ray_entries.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/texture/volume_on_gpu.hpp"

namespace kerf {

/// Iso-surfaces by ray casting in a fragment shader.
///
/// Per volume two passes. The first draws the faces between active and empty macrocells and keeps,
/// per pixel, where its ray first meets an active cell; the second casts the ray from there. So
/// pixels beside the volume cost nothing, and rays begin at most a cell before the surface.
class IsoRenderer final : public Renderer {
 public:
  struct Options {
    bool skip_empty = true;  ///< false: sample every ray from end to end, for comparison
    float step_vox = 0.75F;  ///< a wall of one voxel, antialiased over two, is never stepped over
    std::string_view light = "lighting.frag";  ///< or normals.frag, for measurements
  };

  IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents)
      : IsoRenderer(scene, contents, Options{}) {}
  IsoRenderer(const SceneView& scene, std::span<const VolumeContent> contents, Options options);

  void update(std::size_t volume, std::span<const Density> density,
              std::span<const std::uint32_t> changed) override {
    volumes_[volume].update_bricks(density, changed);
  }
  void place(std::size_t volume, const glm::dmat4& world_from_voxel) override {
    volumes_[volume].place(world_from_voxel);
  }
  void draw(const View& view, const RenderTarget& target) override;
  [[nodiscard]] RayFootprint footprint() const noexcept override;

 private:
  void cast_rays(const VolumeOnGpu& volume, const View& view, const RenderTarget& target);

  Gradient gradient_;
  GlProgram cast_program_;
  GlVertexArray no_vertices_ = GlVertexArray::create();
  GlTexture2D palette_;
  std::vector<VolumeOnGpu> volumes_;
  RayEntries entries_{1};
};

}  // namespace kerf
