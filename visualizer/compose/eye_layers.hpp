// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "visualizer/compose/scene_painter.hpp"
#include "visualizer/gl/program.hpp"
#include "visualizer/gl/target.hpp"

namespace kerf {

/// What is drawn as one triangle over the whole picture, within the parts of its target.
class ScreenPasses {
 public:
  /// Colour, and the depth of the far plane, whatever was there.
  void draw_backdrop(const RenderTarget& target);

  /// Smooths the edges in `from`. A pixel depends on those up to `kSmoothingReach` away.
  static constexpr int kSmoothingReach = 3;
  void smooth_edges(const RenderTarget& from, const RenderTarget& to);

 private:
  GlProgram backdrop_{"screen.vert", "backdrop.frag"};
  GlProgram smooth_{"screen.vert", "smooth.frag"};
};

/// The picture of one eye as it grows, kept from frame to frame: backdrop and opaque volumes, over
/// them the hand and what is translucent, and all that with smoothed edges. So a hand that moves
/// over opaque volumes costs no volume.
class EyeLayers {
 public:
  /// What a picture shows beside the volumes.
  struct Moment {
    View view;
    bool moving = false;  ///< camera or tool are elsewhere than before
    std::optional<Hand> hand;
  };
  /// What must be drawn again, and with what.
  struct Stale {
    Moment now;
    std::vector<PixelRect> opaque, stage;
  };

  explicit EyeLayers(PictureSize size)
      : opaque_(size), stage_(size), smooth_(size), coarse_(size) {}

  /// What shows `view` and `hand` and the volumes, which are now `contents`.
  [[nodiscard]] Stale stale(const View& view, const std::optional<Hand>& hand,
                            const ScenePainter& painter,
                            std::span<const VolumeContent> contents) const;
  /// Draws that. Returns the parts of `seen` that are others now.
  std::vector<PixelRect> draw(const Stale& stale, ScenePainter& painter, ScreenPasses& passes);

  /// The finished picture; its depth is not used.
  [[nodiscard]] const RenderTarget& seen() const noexcept { return smooth_; }

 private:
  void draw_opaque(const Stale& stale, ScenePainter& painter, ScreenPasses& passes);
  void draw_stage(const Stale& stale, ScenePainter& painter);

  RenderTarget opaque_;
  RenderTarget stage_;  ///< with everything
  RenderTarget smooth_;
  StaleTiles coarse_;  ///< of the stage, drawn while something moved: drawn again once it rests
  std::optional<Moment> shown_{};  ///< none: nothing yet
};

}  // namespace kerf
