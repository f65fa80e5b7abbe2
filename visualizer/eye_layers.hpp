// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "visualizer/scene_painter.hpp"
#include "visualizer/screen_passes.hpp"

namespace kerf {

/// The picture of one eye as it grows, kept from frame to frame: backdrop and volumes, over them
/// the hand, and all that with smoothed edges. So a hand that moves over opaque volumes costs no
/// volume.
class EyeLayers {
 public:
  /// What a picture shows beside the volumes.
  struct Moment {
    View view;
    bool moving = false;  ///< the camera is another one than before
    std::optional<Hand> hand;
  };
  /// What must be drawn again, and with what.
  struct Stale {
    Moment now;
    std::vector<PixelRect> volumes, stage;
  };

  explicit EyeLayers(PictureSize size) : volumes_(size), stage_(size), smooth_(size) {}

  /// What shows `view` and `hand` and the volumes, which are now `contents`.
  [[nodiscard]] Stale stale(const View& view, const std::optional<Hand>& hand,
                            const ScenePainter& painter,
                            std::span<const VolumeContent> contents) const;
  /// Draws that. Returns the parts of `seen` that are others now.
  std::vector<PixelRect> draw(const Stale& stale, ScenePainter& painter, ScreenPasses& passes);

  /// The finished picture; its depth is not used.
  [[nodiscard]] const RenderTarget& seen() const noexcept { return smooth_; }

 private:
  void draw_volumes(const Stale& stale, ScenePainter& painter, ScreenPasses& passes);
  void draw_stage(const Stale& stale, ScenePainter& painter);

  RenderTarget volumes_;  ///< the tool too where it is among them
  RenderTarget stage_;    ///< with the hand
  RenderTarget smooth_;
  std::optional<Moment> shown_{};  ///< none: nothing yet
};

}  // namespace kerf
