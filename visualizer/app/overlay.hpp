// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "visualizer/app/force_plot.hpp"
#include "visualizer/app/look_panel.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// Where a led hand wants to be and where it is, in pixels from the upper left corner.
struct HandMark {
  double goal_x = 0.0, goal_y = 0.0;
  double tool_x = 0.0, tool_y = 0.0;
  double radius = 0.0;     ///< of the tool there
  double deeper_mm = 0.0;  ///< the goal than the tool, along the view axis
  friend bool operator==(const HandMark&, const HandMark&) noexcept = default;
};

/// What the panel in the corner says.
struct OverlayFigures {
  double force_n = 0.0;
  double full_force_n = 3.3;  ///< end of the bar
  std::string tool;
  double removed_mm3 = 0.0;
  bool removed_is_partial = false;  ///< joined late: counted from then on
  std::optional<double> tick_rate_hz;
  std::optional<double> frame_rate_hz;
  std::optional<double> data_age_ms;
  std::optional<std::uint64_t> filmed_frames;  ///< written so far; none: no video
  std::string banner;                          ///< shown large; empty: there is nothing to say
  bool alarm = false;                          ///< it says that something is wrong
  bool help = false;                           ///< shows the keys
  bool leads_hand = false;                     ///< with those that lead the hand
  std::optional<HandMark> hand;                ///< none: nobody leads it
  bool hidden = false;                         ///< shows nothing but the banner: for films
  std::vector<ForcePlot::Point> plot;          ///< force and depth over time; empty: no plot
  std::optional<LookControls> controls;        ///< in a window

  /// As far as the panel shows them: two equal ones look alike.
  [[nodiscard]] OverlayFigures rounded() const;
  friend bool operator==(const OverlayFigures&, const OverlayFigures&) noexcept = default;
};

/// The panels over the picture, by Dear ImGui, which is told where the mouse is: it needs no
/// window. One at a time, on the thread of the GL context.
class Overlay {
 public:
  Overlay();
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// What the mouse does to the controls of `figures`, which it changes; draws nothing. True while
  /// the mouse belongs to them and not to the camera.
  bool handle(const Pointer& pointer, OverlayFigures& figures, PictureSize size);
  /// Lays the panels out; returns the part of a picture of this size that they cover. What of them
  /// is wider is cut off.
  PixelRect prepare(const OverlayFigures& figures, PictureSize size);
  /// Draws what was laid out last over `target`: once, or once for each of the `eyes` that lie side
  /// by side in it, at the same place for both, so that the panels seem to lie in the screen.
  void draw(const RenderTarget& target, int eyes = 1);

 private:
  void lay_out(OverlayFigures& figures, PictureSize size);

  LookPanel look_panel_;
};

}  // namespace kerf
