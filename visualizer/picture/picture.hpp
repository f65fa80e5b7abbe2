// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "visualizer/compose/picture_layers.hpp"
#include "visualizer/panels/overlay.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf {

/// What a call of `Picture::draw` did.
struct Redrawn {
  bool any = false;                ///< false: nothing had changed, nothing was drawn
  double fraction = 0.0;           ///< of the picture's pixels in which volumes were drawn again
  double pixels = 0.0;             ///< how many were, of a coarse part fewer than it covers
  std::vector<PixelRect> parts{};  ///< of the target; elsewhere it is what it was; may overlap
};

/// Everything that is seen of one session: backdrop, volumes, tool, force arrow, panel.
///
/// Made after the first `poll` of its session, which is uploaded whole; later only what changed.
class Picture {
 public:
  Picture(const Session& session, const ViewSettings& settings, double aspect);

  /// Uploads the bricks that the last `poll` changed. Call once after each `poll`.
  void update(const Session& session);

  /// Draws the present state, for one eye or for two side by side, into `target`; its depth is not
  /// used. `target` holds what the last call left there, and so do the layers of the picture: while
  /// the camera rests only the part of the screen is drawn again where bricks changed or where the
  /// tool was or is. The result is that of drawing everything.
  Redrawn draw(const Session& session, const OverlayFigures& figures, const RenderTarget& target);
  /// Draws the panels of the last `draw` over another target of its size, as that did.
  void draw_panels(const RenderTarget& target);
  /// A `draw` draws volumes in about so many pixels, all eyes together: what does not fit is seen
  /// coarsely at first and finer with each `draw`. Without a limit at first.
  void set_most_pixels(double most) noexcept { most_pixels_ = most; }
  /// Whether a part is seen coarsely that will be finer without a change.
  [[nodiscard]] bool is_late() const;
  /// The next `draw` draws everything.
  void redraw_all() noexcept { eyes_.clear(); }

  [[nodiscard]] const ViewSettings& settings() const noexcept { return settings_; }
  /// From the next `draw` on. Another renderer or iso value uploads all volumes again, an opacity
  /// only the materials. Throws VisualizerError if the renderer cannot show them, and
  /// changes nothing then.
  void set_view(const Session& session, const ViewSettings& settings);
  /// The scene with the iso values and opacities of the settings.
  [[nodiscard]] SceneView shown_scene() const;
  /// Of all materials, their own or chosen.
  [[nodiscard]] Opacities opacities() const;
  /// For `OverlayFigures::controls`.
  [[nodiscard]] ViewControls controls() const;
  /// See `Overlay::help_pages`.
  [[nodiscard]] int help_pages() const noexcept { return overlay_.help_pages(); }
  /// Of the scene's materials as they are drawn, with what was removed.
  [[nodiscard]] std::vector<ScoreRow> score(const Session& session) const;
  /// The mouse over the panels: see `Overlay::handle`.
  bool handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size);

  /// A plane square to the view axis, through `point_mm`, or without one through the middle of all
  /// volumes.
  [[nodiscard]] ClipPlane facing_plane(const std::optional<glm::dvec3>& point_mm) const;
  /// The plane moved by `mm` towards what it cuts off.
  [[nodiscard]] ClipPlane moved(const ClipPlane& plane, double mm) const;

  [[nodiscard]] OrbitCamera& camera() noexcept { return camera_; }
  [[nodiscard]] const OrbitCamera& camera() const noexcept { return camera_; }
  /// What one eye of a picture of `size` sees; of two, the one in their middle would.
  [[nodiscard]] View middle_view(PictureSize size) const;
  /// Of one eye in a picture of `size`.
  [[nodiscard]] PictureSize eye_size(PictureSize size) const noexcept;
  void reset_camera(double aspect);
  [[nodiscard]] std::uint64_t bricks_uploaded() const noexcept { return bricks_uploaded_; }

 private:
  /// The scene's view with other settings.
  [[nodiscard]] SceneView scene_in(const ViewSettings& settings) const;
  [[nodiscard]] std::unique_ptr<ScenePainter> painter_for(const Session& session,
                                                          const ViewSettings& settings);
  /// Where the box of all volumes begins and ends along a direction, in mm.
  [[nodiscard]] glm::dvec2 reach_along(const glm::dvec3& towards) const;
  /// For `View::clip_plane`.
  [[nodiscard]] glm::dvec4 clip_plane() const;
  /// Of each eye, from the left.
  [[nodiscard]] std::vector<View> views(PictureSize size) const;

  SceneView scene_;
  ViewSettings settings_;
  std::uint64_t bricks_uploaded_ = 0;
  std::unique_ptr<ScenePainter> painter_;  ///< making it counts bricks
  OrbitCamera camera_;
  glm::dvec3 low_mm_{0, 0, 0}, high_mm_{0, 0, 0};  ///< the box of all volumes
  ScreenPasses passes_;
  std::vector<PictureLayers> eyes_;  ///< empty: draw everything
  double most_pixels_ = std::numeric_limits<double>::infinity();
  Overlay overlay_;
  OverlayFigures shown_figures_;
  GLuint shown_in_ = 0;                  ///< framebuffer, whose name may be given to a later one
  PictureSize shown_size_;               ///< of all of it
  std::vector<PixelRect> shown_panels_;  ///< of each eye
};

/// `Picture::draw`, complete when it returns, with its times and what it did in the report;
/// takes the session's oldest removal for the latency.
Redrawn draw_measured(Picture& picture, Session& session, const OverlayFigures& figures,
                      const RenderTarget& target, FrameReport& report);

/// The figures of the panel as the session stands; the caller adds what it alone knows.
[[nodiscard]] OverlayFigures overlay_figures(const Session& session);

}  // namespace kerf
