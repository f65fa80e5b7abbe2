// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "visualizer/compose/hand_painter.hpp"
#include "visualizer/compose/stale_volume.hpp"
#include "visualizer/compose/tool_volume.hpp"
#include "visualizer/render/volume_renderers.hpp"

namespace kerf {

/// Volumes and hand as the chosen renderers show them: what is drawn over what, and which tiles of
/// a picture a change of either leaves stale.
///
/// Opaque volumes come first, so that a tool which moves leaves them as they are; translucent ones
/// come after the tool, which shines through them. A tool of voxels is a volume itself, drawn as
/// the first one is.
class ScenePainter {
 public:
  using Layer = VolumeRenderers::Layer;

  /// `renderers` is a choice: renderer_choice.hpp. Throws VisualizerError where that does not fit
  /// the scene, or a renderer cannot show its volumes.
  ScenePainter(const std::string& renderers, const SceneView& scene,
               std::span<const VolumeContent> contents);

  [[nodiscard]] VolumeRenderers& renderers() noexcept { return renderers_; }
  [[nodiscard]] const VolumeRenderers& renderers() const noexcept { return renderers_; }

  /// The scene with other opacities; `contents` are all of its volumes.
  void set_opacities(const SceneView& scene, std::span<const VolumeContent> contents);
  /// See `Renderer`; `contents` are all volumes of the scene.
  void set_cut_open(bool open, std::span<const VolumeContent> contents);
  /// What the last poll changed in a volume.
  void update(std::size_t volume, const VolumeSnapshot& snapshot);
  /// Puts a tool of voxels into the hand: before anything is drawn with it.
  void hold(const Hand& hand);

  /// Volumes, and among them a tool of voxels.
  void draw_volumes(Layer layer, const View& view, const RenderTarget& target) {
    renderers_.draw(layer, view, target);
  }
  /// The tool as a mesh: after the opaque volumes, before the others.
  void draw_tool(const Hand& hand, const View& view, const RenderTarget& target);
  /// The last of all.
  void draw_force(const Hand& hand, const View& view, const RenderTarget& target) {
    hand_.draw_force(hand, view, target);
  }
  /// A hand that moves changes what the opaque volumes are.
  [[nodiscard]] bool hand_is_opaque_volume() const {
    return tool_ && renderers_.layer_of(volumes_.size()) == Layer::opaque;
  }
  /// Rectangles of pixels that the hand may touch.
  [[nodiscard]] std::vector<PixelRect> bounds(const Hand& hand, const View& view,
                                              PictureSize size) const;

  /// Marks what changed in the volumes of a layer since `forget_changes`. `contents` are all of
  /// them as they are now; `kept` holds the opaque ones as they were drawn before, and no other.
  void mark_volumes(Layer layer, StaleTiles& tiles, std::span<const VolumeContent> contents,
                    const View& view, const RenderTarget& kept) const;
  void forget_changes();

 private:
  /// And the tool's.
  [[nodiscard]] std::vector<VolumeContent> with_tool(std::span<const VolumeContent> contents) const;
  [[nodiscard]] VolumeRenderers made(const std::string& renderers, const SceneView& scene,
                                     std::span<const VolumeContent> contents) const;

  std::vector<VolumeView> volumes_;  ///< of the session
  std::optional<ToolVolume> tool_;
  VolumeRenderers renderers_;
  std::vector<StaleVolume> stale_;  ///< by volume
  HandPainter hand_;
};

}  // namespace kerf
