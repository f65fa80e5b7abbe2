// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "shared/segment/layout.hpp"
#include "visualizer/gl/gl_objects.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/panels/control_panels.hpp"
#include "visualizer/scene/cross_sections.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// Commanded force and depth of the tool over the last five seconds of the machine's clock. One
/// point per picture: the newest tick at that time.
class ForcePlot {
 public:
  static constexpr double kSpanS = 5.0;

  struct Point {
    std::uint64_t time_ns = 0;  ///< CLOCK_MONOTONIC
    float force_n = 0.0F;
    float penetration_mm = 0.0F;
    friend bool operator==(const Point&, const Point&) noexcept = default;
  };

  /// A record that is not newer than the last one changes nothing.
  void add(const TickRecord& record);

  /// Oldest first; all within the span before the last one.
  [[nodiscard]] const std::vector<Point>& points() const noexcept { return points_; }

 private:
  std::vector<Point> points_;
};

/// Where a led hand wants to be and where it is, in pixels from the upper left corner.
struct HandMark {
  double goal_x = 0.0, goal_y = 0.0;
  double tool_x = 0.0, tool_y = 0.0;
  double radius = 0.0;     ///< of the tool there
  double deeper_mm = 0.0;  ///< the goal than the tool, along the view axis
  friend bool operator==(const HandMark&, const HandMark&) noexcept = default;
};

/// A list of what may be opened, and what the mouse chose of it.
struct OpenPanel {
  FolderList list;
  std::optional<std::size_t> chosen{};  ///< index of its entries
  friend bool operator==(const OpenPanel&, const OpenPanel&) noexcept = default;
};

/// A material with its colour in the picture, sRGB 0..1, and what was removed of it.
struct ScoreRow {
  std::string name;
  float red = 0.0F, green = 0.0F, blue = 0.0F;
  double removed_mm3 = 0.0;
  friend bool operator==(const ScoreRow&, const ScoreRow&) noexcept = default;
};

/// What turns the tool.
struct SpindleFigures {
  double krpm = 0.0;
  double load = 0.0;  ///< torque over the stall torque
  friend bool operator==(const SpindleFigures&, const SpindleFigures&) noexcept = default;
};

/// The second arm, in short.
struct SecondArmFigures {
  double force_n = 0.0;
  std::string tool;
  std::string state;   ///< its phase, or its fault
  bool alarm = false;  ///< it has a fault
  friend bool operator==(const SecondArmFigures&, const SecondArmFigures&) noexcept = default;
};

/// The figures of the panel in the corner.
struct OverlayFigures {
  double force_n = 0.0;
  double full_force_n = 3.3;  ///< end of the bar
  std::string tool;
  std::optional<SecondArmFigures> second;  ///< none: there is one arm
  double removed_mm3 = 0.0;
  std::vector<ScoreRow> score;            ///< of the scene's materials
  bool score_is_partial = false;          ///< something was cut before this one joined
  std::string forbidden;                  ///< which of them may not be cut; empty: none
  double forbidden_ms = 0.0;              ///< they were pressed upon for so long
  std::optional<SpindleFigures> spindle;  ///< none: the scene's removal has no spindle
  std::optional<double> pulp_rise_c;      ///< of the tooth, as a mark; none: the scene has none
  bool pulp_harmed = false;               ///< it has been too warm
  std::optional<double> tick_rate_hz;
  std::optional<double> frame_rate_hz;
  std::optional<double> data_age_ms;
  std::optional<double> picture_age_ms;        ///< of the newest state that is shown finely
  std::optional<std::uint64_t> filmed_frames;  ///< written so far; none: no video
  std::string banner;                          ///< shown large; empty: there is nothing to say
  bool alarm = false;                          ///< the banner reports a fault
  int help = 0;                                ///< shows this page of the keys, and no panel
  bool leads_hand = false;                     ///< with those that lead the hand
  std::optional<HandMark> hand;                ///< none: it is not led
  bool hidden = false;                         ///< shows nothing but the banner: for films
  std::vector<ForcePlot::Point> plot;    ///< force and depth over time, in place of score and rates
  std::optional<SliceViews> slices;      ///< in place of plot and rates
  std::optional<ViewControls> controls;  ///< in a window
  std::optional<OpenPanel> open;         ///< in place of all panels
  /// Of the letters, over those for 96 dots per inch; as far as the picture has room.
  double scale = 1.0;

  /// The figures with the digits that the panel shows: two equal ones look alike.
  [[nodiscard]] OverlayFigures rounded() const;
  friend bool operator==(const OverlayFigures&, const OverlayFigures&) noexcept = default;
};

/// The panels over the picture, by Dear ImGui, which is given the position of the mouse: it needs
/// no window. One at a time, on the thread of the GL context.
///
/// Together, without the slices, they cover at most a quarter of a picture of 640x480 or more: what
/// a full panel has no room for is scrolled to or, of the keys, on a page of its own. A menu that
/// is open comes on top.
class Overlay {
 public:
  Overlay();
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// What the mouse does to the controls of `figures`, which it changes; draws nothing. True while
  /// the mouse belongs to them and not to the camera.
  bool handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size);
  /// Lays the panels out; returns the part of a picture of this size that each covers. What of them
  /// is wider is cut off.
  std::vector<PixelRect> prepare(const OverlayFigures& figures, PictureSize size);
  /// Draws what was laid out last over `target`: once, or once for each of the `eyes` that lie side
  /// by side in it, at the same place for both, so that the panels seem to lie in the screen.
  void draw(const RenderTarget& target, int eyes = 1);
  /// Of the keys, as they were laid out last.
  [[nodiscard]] int help_pages() const noexcept { return help_pages_; }

 private:
  void begin_frame(const OverlayFigures& figures, PictureSize size);
  void lay_out(OverlayFigures& figures, PictureSize size);
  void show(const SliceViews& slices);

  SettingsPanel settings_panel_;
  float letters_ = 0.0F;  ///< height of those that are loaded, in pixels
  int help_pages_ = 1;
  std::optional<SliceViews> uploaded_;
  std::optional<GlTexture2D> slices_;
};

/// Side of the three slices in a picture of this size, whose panel takes a third of its width or
/// all of its height; 0 if there is no room.
[[nodiscard]] int slice_side(PictureSize size, double scale);

/// What came of something that the user asked for.
struct Notice {
  std::string text;
  bool problem = false;
};

/// Shows notices to the user of a window: on the terminal at once, and in the picture for a while,
/// because the terminal may be out of sight.
class Notices {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kShownFor = std::chrono::seconds(4);

  void say(const Notice& notice, Clock::time_point now);
  /// From the picture.
  void clear() noexcept { shown_until_ = {}; }
  /// Takes the banner; hidden panels leave only what is a problem.
  void show(OverlayFigures& figures, Clock::time_point now) const;

 private:
  Notice last_;
  Clock::time_point shown_until_{};
};

/// The panel's figures that differ in every frame though nothing happens: rates, the data's age,
/// frames filmed. Each stays for `kHold`, so that it can be read, and so that a still hand leaves
/// frames in which nothing is to be drawn.
class ShownRates {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kHold = std::chrono::milliseconds(250);

  /// Call once per frame, which begins `now`: adds the frame rate, and puts what was shown before
  /// in the place of what is newer, until its time is over.
  void show(OverlayFigures& figures, Clock::time_point now);

 private:
  /// Frames begun in the last second; none before the second one.
  [[nodiscard]] std::optional<double> frame_rate_hz() const;

  std::deque<Clock::time_point> frames_;
  std::optional<Clock::time_point> shown_since_;
  std::optional<double> tick_rate_hz_, frame_rate_hz_, data_age_ms_, picture_age_ms_;
  std::optional<std::uint64_t> filmed_frames_;
};

}  // namespace kerf
