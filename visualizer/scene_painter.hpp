// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "visualizer/hand_painter.hpp"
#include "visualizer/renderer.hpp"
#include "visualizer/stale_volume.hpp"
#include "visualizer/tool_volume.hpp"

namespace kerf {

/// Volumes and hand as one renderer shows them: what is drawn over what, and which tiles of a
/// picture a change of either leaves stale.
///
/// Translucent volumes come after the tool, which shines through them; opaque ones come before it,
/// so that a tool which moves leaves them as they are. A tool of voxels is a volume itself.
class ScenePainter {
 public:
  /// Throws VisualizerError where the renderer is unknown or cannot show the volumes.
  ScenePainter(std::string_view renderer, const SceneView& scene,
               std::span<const VolumeContent> contents);

  [[nodiscard]] Renderer& renderer() noexcept { return *renderer_; }
  [[nodiscard]] const Renderer& renderer() const noexcept { return *renderer_; }

  /// The scene with other opacities; `contents` are all of its volumes.
  void set_opacities(const SceneView& scene, std::span<const VolumeContent> contents);
  /// What the last poll changed in a volume.
  void update(std::size_t volume, const VolumeSnapshot& snapshot);

  /// Volumes, and the tool where that is drawn among them.
  void draw_volumes(const std::optional<Hand>& hand, const View& view, const RenderTarget& target);
  /// The rest of the hand: the force, and the tool where that comes after the volumes.
  void draw_over(const Hand& hand, const View& view, const RenderTarget& target);
  /// A hand that moves changes what `draw_volumes` draws.
  [[nodiscard]] bool hand_is_among_volumes() const noexcept {
    return tool_ || renderer_->translucent();
  }
  /// Rectangles of pixels that the hand may touch.
  [[nodiscard]] std::vector<PixelRect> bounds(const Hand& hand, const View& view,
                                              PictureSize size) const;

  /// Marks what changed in the volumes since `forget_changes`. `contents` are all of them as they
  /// are now, `kept` what `draw_volumes` drew before.
  void mark_volumes(StaleTiles& tiles, std::span<const VolumeContent> contents, const View& view,
                    const RenderTarget& kept) const;
  void forget_changes();

 private:
  /// Puts the tool of voxels into the hand.
  void hold_tool(const Hand& hand);

  std::vector<VolumeView> volumes_;  ///< of the session
  std::optional<ToolVolume> tool_;
  std::unique_ptr<Renderer> renderer_;
  std::vector<StaleVolume> stale_;  ///< by volume
  HandPainter hand_;
};

}  // namespace kerf
