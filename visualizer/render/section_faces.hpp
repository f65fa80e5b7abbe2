// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "visualizer/gl/target.hpp"
#include "visualizer/texture/solid_on_gpu.hpp"

namespace kerf {

/// The faces that a clip plane cuts into volumes whose surfaces are meshes, in the colours of their
/// materials: each pixel whose ray enters the plane in what is solid.
class SectionFaces {
 public:
  /// Throws VisualizerError where the driver takes no textures of this size.
  SectionFaces(const SceneView& scene, std::span<const VolumeContent> contents);

  /// As those of `Renderer`.
  void update(std::size_t volume, std::span<const Density> density,
              std::span<const std::uint32_t> changed);
  void place(std::size_t volume, const glm::dmat4& world_from_voxel);
  /// Draws over what is in `target`, under its depth test.
  void draw(const View& view, const RenderTarget& target) const;

 private:
  GlProgram program_{"screen.vert", "section.frag",  "solid.frag",
                     "ray.frag",    "lighting.frag", "depth.frag"};
  GlVertexArray no_vertices_ = GlVertexArray::create();
  GlTexture2D palette_;
  std::vector<SolidOnGpu> volumes_;
};

}  // namespace kerf
