// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "visualizer/render/macrocell_faces.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/translucent_volumes.hpp"
#include "visualizer/scene/camera.hpp"

namespace kerf {

/// Looks into the volumes by ray casting in a fragment shader, front to back.
///
/// Draw opaque things first: rays end at the depth that `target` has, so what lies inside or behind
/// shines through. Volumes that intersect mix along one ray. The depth written is that of the
/// first sample with an opacity of `kLeastOpacity`; what never reaches it is not
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

  void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) override {
    volumes_.volumes()[volume].set_transform(world_from_voxel);
  }
  void set_opacities(std::span<const MaterialView> materials,
                     std::span<const VolumeContent> contents) override {
    volumes_.set_opacities(materials, contents);
  }
  void draw(const View& view, const RenderTarget& target) override;
  [[nodiscard]] bool translucent() const noexcept override { return true; }

 private:
  void upload(std::size_t volume, std::span<const Density> density,
              const ChangedBricks& changed) override {
    volumes_.volumes()[volume].update_bricks(density, changed);
  }

  TranslucentVolumes volumes_;
  RayEntries entries_;
  GlProgram cast_program_;
  TranslucentLayer layer_;
};

/// The convex polygon in which the plane `eye_mm` away along the view axis cuts a box given by its
/// corners in eye space (bit 0 of the index: high x, bit 1: high y, bit 2: high z). At most six
/// vertices (x, y), in order around; fewer than three if the plane misses the box.
[[nodiscard]] std::vector<glm::dvec2> cut_box(const BoxCorners& eye_corners, double eye_mm);

/// The paper's volume rendering without ray casting: slices at right angles to the view axis
/// through a 3D texture of density and gradient, blended from back to front.
///
/// Shows what `blend` shows, and treats `target` as it does: draw opaque things first. The slices
/// of all volumes are drawn in one order, so volumes that intersect mix to within a slice.
class SlicesRenderer final : public Renderer {
 public:
  struct Options {
    float step_vox = 1.0F;         ///< between slices, in the shortest voxel edge of all volumes
    float moving_step_vox = 3.0F;  ///< between slices while camera or objects move
  };

  SlicesRenderer(const SceneView& scene, std::span<const VolumeContent> contents)
      : SlicesRenderer(scene, contents, Options{}) {}
  SlicesRenderer(const SceneView& scene, std::span<const VolumeContent> contents, Options options);

  void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) override;
  void set_moving(bool moving) override { moving_ = moving; }
  [[nodiscard]] bool coarse_while_moving() const noexcept override { return true; }
  void set_opacities(std::span<const MaterialView> materials,
                     std::span<const VolumeContent> contents) override;
  void draw(const View& view, const RenderTarget& target) override;
  [[nodiscard]] bool translucent() const noexcept override { return true; }

 private:
  void upload(std::size_t volume, std::span<const Density> density,
              const ChangedBricks& changed) override;
  /// One volume with a program of its own: shaders index textures by constants.
  struct Sliced {
    Sliced(const SceneView& scene, const VolumeContent& content);
    TranslucentVolumes volume;
    GlProgram program;
  };
  /// A polygon of one volume in one slice.
  struct Cut {
    int slice;
    std::size_t volume;
    GLint first;
    GLsizei count;
  };

  void cut_volume(std::size_t volume, const View& view, double step_mm);
  void draw_cuts(const View& view, const RenderTarget& target) const;

  Options options_;
  bool moving_ = false;
  std::vector<std::unique_ptr<Sliced>> volumes_;
  double edge_mm_ = 0.0;
  std::vector<glm::vec3> vertices_;
  std::vector<Cut> cuts_;
  GlBuffer buffer_ = GlBuffer::create();
  GlVertexArray array_ = GlVertexArray::create();
  TranslucentLayer layer_;
};

}  // namespace kerf
