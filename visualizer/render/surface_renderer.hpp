// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/volume_textures.hpp"
#include "visualizer/surface/surface_on_gpu.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

/// The faces that a clip plane cuts into volumes whose surfaces are meshes, in the colours of their
/// materials: each pixel whose ray enters the plane in what is solid.
class ClipCaps {
 public:
  /// Throws VisualizerError if the driver takes no textures of this size.
  ClipCaps(const SceneView& scene, std::span<const VolumeContent> contents);

  [[nodiscard]] std::span<SolidOnGpu> volumes() noexcept { return volumes_; }
  /// Draws over what is in `target`, under its depth test.
  void draw(const View& view, const RenderTarget& target) const;

 private:
  GlProgram program_;
  GlTexture2D palette_;
  std::vector<SolidOnGpu> volumes_;
};

/// Iso-surfaces as meshes: marching cubes on the CPU, again only around what changed; the GPU draws
/// triangles and never sees the volume.
///
/// A mesh is hollow; a clip plane would show its inside. While volumes are cut open they are
/// textures too, from which the face in the plane is drawn.
///
/// Honours the GL scissor: blocks beside it are not drawn at all.
class SurfaceRenderer final : public Renderer {
 public:
  SurfaceRenderer(const SceneView& scene, std::span<const VolumeContent> contents);

  void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) override;
  void set_cut_open(bool open, std::span<const VolumeContent> contents) override;
  void draw(const View& view, const RenderTarget& target) override;
  /// By the triangles that changed; while volumes are cut open, by changed cells too.
  void mark_redraw(std::size_t volume, const KeptPicture& kept, RedrawTiles& tiles) const override;
  void forget_changes() override;

 private:
  struct Volume {
    VolumeSurface surface;
    SurfaceOnGpu gpu;
    std::vector<FineTriangle> changed{};  ///< since `forget_changes`, before and after
    VoxelBox changed_box{};               ///< around those that were too many for a list
  };

  void upload(std::size_t volume, std::span<const Density> density,
              const ChangedBricks& changed) override;

  SceneView scene_;  ///< its volumes where they are now
  GlProgram program_;
  std::vector<Volume> volumes_;
  std::optional<ClipCaps> caps_;  ///< while volumes are cut open
};

}  // namespace kerf
