// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "visualizer/camera.hpp"
#include "visualizer/frame_report.hpp"
#include "visualizer/hand_painter.hpp"
#include "visualizer/look.hpp"
#include "visualizer/overlay.hpp"
#include "visualizer/renderer.hpp"
#include "visualizer/session.hpp"
#include "visualizer/stale_volume.hpp"

namespace kerf {

/// What a call of `Picture::draw` did.
struct Redrawn {
  bool any = false;    ///< false: nothing had changed, nothing was drawn
  double share = 0.0;  ///< of the picture's pixels: where volumes were drawn again
};

/// Everything that is seen of one session: backdrop, volumes, tool, force arrow, panel.
///
/// Made after the first `poll` of its session, which is uploaded whole; later only what changed.
class Picture {
 public:
  Picture(const Session& session, const Look& look, double aspect);

  /// Uploads the bricks that the last `poll` changed. Call once after each `poll`.
  void update(const Session& session);

  /// Draws the present state, for one eye or for two side by side, into `target`; its depth is not
  /// used. `target` holds what the last call left there, and so do the layers of the picture: while
  /// the camera rests only the part of the screen is drawn again where bricks changed or where the
  /// tool was or is. The result is that of drawing everything.
  Redrawn draw(const Session& session, const OverlayFigures& figures, const RenderTarget& target);
  /// The next `draw` draws everything.
  void redraw_all() noexcept { eyes_.clear(); }

  [[nodiscard]] const Look& look() const noexcept { return look_; }
  /// From the next `draw` on. Another renderer or iso value uploads all volumes again, an opacity
  /// only the materials. Throws VisualizerError where the renderer cannot show them; the look stays
  /// then.
  void set_look(const Session& session, const Look& look);
  /// The scene with the iso values and opacities of the look.
  [[nodiscard]] SceneView shown_scene() const;
  /// Of all materials, their own or chosen.
  [[nodiscard]] Opacities opacities() const;
  /// For `OverlayFigures::controls`.
  [[nodiscard]] LookControls controls() const;
  /// The mouse over the panels: see `Overlay::handle`.
  bool handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size);

  [[nodiscard]] OrbitCamera& camera() noexcept { return camera_; }
  void reset_camera(double aspect);
  [[nodiscard]] std::uint64_t bricks_uploaded() const noexcept { return bricks_uploaded_; }

 private:
  /// The same of another look.
  [[nodiscard]] SceneView scene_in(const Look& look) const;
  [[nodiscard]] std::unique_ptr<Renderer> renderer_for(const Session& session, const Look& look);
  /// `View::shown` of the clip plane.
  [[nodiscard]] glm::dvec4 shown_half() const;
  void draw_backdrop(const RenderTarget& target);
  void smooth_edges(const RenderTarget& from, const RenderTarget& to);

  SceneView scene_;
  Look look_;
  std::unique_ptr<Renderer> renderer_;
  OrbitCamera camera_;
  glm::dvec3 low_mm_{0, 0, 0}, high_mm_{0, 0, 0};  ///< the box of all volumes
  double size_mm_ = 1.0;                           ///< half the diagonal of the main volume's box
  GlProgram backdrop_{"screen.vert", "backdrop.frag"};
  GlProgram smooth_{"screen.vert", "smooth.frag"};
  /// The picture as it grows, kept from frame to frame.
  struct Layers {
    explicit Layers(PictureSize size) : volumes(size), stage(size), smooth(size) {}
    RenderTarget volumes;  ///< backdrop and volumes; the tool too where they are translucent
    RenderTarget stage;    ///< with the hand
    RenderTarget smooth;   ///< with smoothed edges
  };
  /// What the layers show.
  struct Shown {
    View view;
    bool moving = false;
    std::optional<Hand> hand;
  };
  /// A whole picture, or one half of two side by side.
  struct Eye {
    explicit Eye(PictureSize size) : layers(size) {}
    Layers layers;
    std::optional<Shown> shown{};  ///< none: nothing yet
  };
  /// What must be drawn again, and with what.
  struct Stale {
    Shown now;
    std::vector<PixelRect> volumes, stage;
  };
  /// Of one eye in a picture of `size`.
  [[nodiscard]] PictureSize eye_size(PictureSize size) const noexcept;
  /// Of each eye, from the left.
  [[nodiscard]] std::vector<View> views(PictureSize size) const;
  [[nodiscard]] Stale stale(const Eye& eye, const Shown& now, const Session& session) const;
  /// Marks what changed densities and, where it moved, the hand change.
  void mark_volumes(StaleTiles& tiles, const Session& session, const View& view,
                    const RenderTarget& kept) const;
  void mark_hand(StaleTiles& tiles, const Shown& now, const Shown& before, PictureSize size) const;
  /// Returns the parts of the smooth layer that are others now.
  std::vector<PixelRect> draw_layers(Eye& eye, const Stale& stale);

  std::vector<Eye> eyes_;  ///< empty: draw everything
  OverlayFigures shown_figures_;
  GLuint shown_in_ = 0;             ///< framebuffer, whose name may be given to a later one
  PictureSize shown_size_;          ///< of all of it
  PixelRect shown_panels_;          ///< of each eye
  std::vector<StaleVolume> stale_;  ///< by volume, since the last `draw`
  GlVertexArray no_vertices_ = GlVertexArray::create();
  HandPainter hand_painter_;
  Overlay overlay_;
  std::uint64_t bricks_uploaded_ = 0;
};

/// `Picture::draw`, complete when it returns, with its times and what it did in the report;
/// takes the session's oldest removal for the latency.
Redrawn draw_measured(Picture& picture, Session& session, const OverlayFigures& figures,
                      const RenderTarget& target, FrameReport& report);

/// The figures of the panel as the session stands; the caller adds what it alone knows.
[[nodiscard]] OverlayFigures overlay_figures(const Session& session);

}  // namespace kerf
