// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <vector>

#include "visualizer/cast/caster.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

/// Hands the pictures of `Caster` to GL. Only the target's parts, and of them what can show
/// anything, are cast.
///
/// Iso goes under the depth test of the target. Blend ends its rays at what is in the target, lies
/// over it, and sets depth where enough of it has gathered to hide what comes later. With
/// `SceneView::normals` iso hands over its normals in place of its colours.
class CastRenderer final : public Renderer {
 public:
  CastRenderer(const SceneView& scene, std::span<const VolumeContent> contents, CastMode mode);

  void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) override {
    caster_.set_transform(volume, world_from_voxel);
  }
  void set_opacities(std::span<const MaterialView> materials,
                     std::span<const VolumeContent> contents) override;
  void draw(const View& view, const RenderTarget& target) override;
  [[nodiscard]] bool translucent() const noexcept override { return mode_ == CastMode::blend; }

 private:
  void upload(std::size_t volume, std::span<const Density> density,
              const ChangedBricks& changed) override {
    caster_.update(volume, density, changed);
  }
  [[nodiscard]] const GradientRows* surface_gradient(std::size_t volume) const override {
    return mode_ == CastMode::iso ? &caster_.gradient(volume) : nullptr;
  }
  /// The picture on both sides.
  struct Frame {
    Frame(PictureSize size, bool normals);
    CastPicture picture;
    std::vector<float> normals;  ///< three of each pixel, or none
    std::vector<float> end_depth;
    GlTexture2D colour = GlTexture2D::create();
    GlTexture2D depth = GlTexture2D::create();
  };

  /// That of this size.
  [[nodiscard]] Frame& frame_of(PictureSize size);
  /// Pixels that may show anything of the volumes.
  [[nodiscard]] PixelRect bounds(const View& view, PictureSize size) const;
  static void read_end_depth(Frame& frame, const RenderTarget& target, const PixelRect& rect);
  static void upload(const Frame& frame, const PixelRect& rect);
  void show(const Frame& frame, const RenderTarget& target);

  CastMode mode_;
  bool normals_;
  Caster caster_;
  GlProgram program_{"screen.vert", "cast.frag"};
  std::list<Frame> frames_;       ///< two at most: finely and coarsely drawn parts take turns
  std::vector<PixelRect> parts_;  ///< that are cast in this frame
};

}  // namespace kerf
