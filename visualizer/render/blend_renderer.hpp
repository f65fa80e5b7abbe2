// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/render/ray_entries.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/translucent_layer.hpp"
#include "visualizer/texture/translucent_volumes.hpp"

namespace kerf {

/// Looks into the volumes by ray casting in a fragment shader, front to back.
///
/// Draw opaque things first: rays end at the depth that `target` has, so what lies inside or behind
/// shines through. Volumes that intersect mix along one ray. The depth written is that of the
/// first sample with an opacity of `kLeastOpacity` per voxel edge; what never reaches it is not
/// drawn.
class BlendRenderer final : public Renderer {
 public:
  struct Options {
    bool skip_empty = true;  ///< false: sample every ray from end to end, for comparison
    float step_vox = 1.0F;   ///< along the view axis, in the shortest voxel edge of all volumes
  };

  BlendRenderer(const SceneView& scene, std::span<const VolumeContent> contents)
      : BlendRenderer(scene, contents, Options{}) {}
  BlendRenderer(const SceneView& scene, std::span<const VolumeContent> contents, Options options);

  void update(std::size_t volume, std::span<const Density> density,
              std::span<const std::uint32_t> changed) override {
    volumes_.volumes()[volume].update_bricks(density, changed);
  }
  void place(std::size_t volume, const glm::dmat4& world_from_voxel) override {
    volumes_.volumes()[volume].place(world_from_voxel);
  }
  void set_opacities(std::span<const MaterialView> materials,
                     std::span<const VolumeContent> contents) override {
    volumes_.set_opacities(materials, contents);
  }
  void draw(const View& view, const RenderTarget& target) override;
  [[nodiscard]] bool translucent() const noexcept override { return true; }

 private:
  TranslucentVolumes volumes_;
  RayEntries entries_;
  GlProgram cast_program_;
  TranslucentLayer layer_;
};

}  // namespace kerf
