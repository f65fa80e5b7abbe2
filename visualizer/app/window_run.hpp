// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/app/hand_control.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/app/shared_view.hpp"
#include "visualizer/app/window_keys.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/panels/overlay.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/picture/picture.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf {

/// The session in a window and its picture. A controller that is started again under the same name
/// replaces the one that ended; the view settings stay.
class FollowedSession {
 public:
  using Clock = std::chrono::steady_clock;

  FollowedSession(const VisualizerOptions& options, Session first, double aspect);

  [[nodiscard]] Session& session() noexcept { return session_; }
  [[nodiscard]] Picture& picture() noexcept { return *picture_; }
  /// Of all sessions so far.
  [[nodiscard]] std::uint64_t bricks_uploaded() const {
    return earlier_bricks_ + picture_->bricks_uploaded();
  }

  /// Of those that were shown so far, from 1.
  [[nodiscard]] std::uint64_t runs() const noexcept { return runs_; }

  /// Brings both up to the present.
  void update(double aspect, Clock::time_point now);

 private:
  void attach_again(double aspect, Clock::time_point now);

  const VisualizerOptions& options_;
  Session session_;
  std::optional<Picture> picture_;
  std::uint64_t earlier_bricks_ = 0, runs_ = 1;
  Clock::time_point next_attach_{};
};

/// How many pixels with volumes in them a frame draws, so that it takes about `kFrameMs`: from what
/// the frames before took. The least at first.
class FramePace {
 public:
  static constexpr double kFrameMs = 50;  // the hand is led by what a frame shows

  [[nodiscard]] double most_pixels() const noexcept { return kFrameMs / ms_per_pixel_; }
  /// From a frame that drew so many in a picture of `size`, which took `ms`.
  void learn(double pixels, PictureSize size, double ms) noexcept;

 private:
  double ms_per_pixel_ = std::numeric_limits<double>::infinity();
  bool begun_ = false;
};

/// What a window does from its first frame to its last: input, the session, panels, picture, film.
/// It needs no window: what it draws is a target, and what the user did is handed to it. `options`
/// outlives it.
class WindowRun {
 public:
  using Clock = std::chrono::steady_clock;

  /// What came of a frame.
  struct Frame {
    bool quit = false;                    ///< the user wants to leave; nothing else was done
    const RenderTarget* drawn = nullptr;  ///< to be presented; none: what was, stays
    std::vector<PixelRect> parts{};       ///< of it, that are not what the last frame presented
    bool leads_hand = false;              ///< the ring stands for the pointer
  };

  /// `context` is current, now and in each step; `since_attached` began when `first` did.
  WindowRun(const VisualizerOptions& options, Session first, const GlContext& context,
            const Stopwatch& since_attached = {});

  /// One frame that begins `now`, in a window of `size`, of which a side is 0 while nothing of it
  /// is seen.
  Frame step(const WindowInput& input, PictureSize size, Clock::time_point now);

  /// Tells the user, in the picture and on the terminal.
  void say(const Notice& notice, Clock::time_point now) { notices_.say(notice, now); }

  /// Completes and writes the report; returns the exit code.
  [[nodiscard]] int end();

  /// Each frame draws volumes in about so many pixels, in place of those of a pace.
  void set_most_pixels(double most) noexcept { fixed_pixels_ = most; }

  [[nodiscard]] double age_ms() const { return since_attached_.wall_ms(); }
  [[nodiscard]] Session& session() noexcept { return followed_.session(); }
  [[nodiscard]] Picture& picture() noexcept { return followed_.picture(); }

 private:
  [[nodiscard]] OverlayFigures figures_at(PictureSize size, Clock::time_point now);
  /// Opens or leaves the list of scenes, if a program waits for a choice.
  void toggle_list(Clock::time_point now);
  /// What the mouse chose of it: another folder, or what the window ends with.
  void choose(const OpenPanel& panel, Clock::time_point now);
  /// For one eye's picture of `size`; none while the position of the tip is unknown.
  [[nodiscard]] std::optional<SliceViews> slices_at_tip(PictureSize size);
  /// What the user wants of hand and camera; the mark of the hand goes into the figures.
  void follow(const WindowInput& input, OverlayFigures& figures, PictureSize size,
              Clock::time_point now);
  /// What the camera turns about while the pointer is a hand, whose wheel and button are its own.
  [[nodiscard]] std::optional<glm::dvec3> hand_centre_mm();
  void lead_hand(const WindowInput& input, bool over_panel, OverlayFigures& figures,
                 PictureSize size, Clock::time_point now);
  /// Tells how long the run will last, two minutes and ten seconds before its end.
  void foretell_end(Clock::time_point now);
  /// Warns once if the tool cuts without the pedal.
  void check_pedal(Clock::time_point now);
  void time_the_tool(const WindowInput& input, const glm::dvec3& tool_mm, Clock::time_point now);
  Redrawn draw(PictureSize size, const WindowInput& input, Clock::time_point now);

  const VisualizerOptions& options_;
  const Stopwatch since_attached_;
  bool record_from_start_, video_is_cut_ = false;
  FrameReport report_;
  double aspect_;
  double density_ = 1.0;  ///< of the display
  FollowedSession followed_;
  SharedView shared_view_;
  FramePace pace_;
  std::optional<double> fixed_pixels_;
  /// Began the last frame after which all was shown as finely as it will be.
  std::optional<Clock::time_point> complete_since_;
  std::optional<RenderTarget> target_;
  ShownRates rates_;
  WindowKeys keys_;
  Notices notices_;
  ForcePlot plot_;
  std::optional<Film> film_;
  std::optional<SliceViews> slices_;  ///< made last, where and with what
  glm::dvec3 sliced_at_mm_{0.0};
  ViewSettings sliced_with_;
  std::optional<OpenPanel> open_;
  bool chosen_ = false;  ///< and written: the window ends
  std::optional<HandLink> hand_link_;
  std::optional<SpaceMouse> space_mouse_;
  PointerHand hand_;
  Clock::time_point last_led_{};
  glm::dvec3 last_tool_mm_{0.0};
  /// Since when, and from where, a tool that rested is to follow the pointer.
  std::optional<std::pair<Clock::time_point, glm::dvec3>> followed_since_;
  bool pointer_leads_ = false, tool_follows_ = false;
  bool in_second_eye_ = false, in_stereo_ = false;
  PictureSize led_in_;  ///< the window's size at the last step of the hand
  double told_left_s_ = std::numeric_limits<double>::infinity();  ///< of the run
  bool press_is_hands_ = false;    ///< the left button went down over the picture
  bool led_ = false;               ///< the last frame sent a target
  bool pedal_is_checked_ = false;  ///< whether the controller obeys it
};

}  // namespace kerf
