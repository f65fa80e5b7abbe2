// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "visualizer/gl/target.hpp"

namespace kerf {

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
  std::string banner;  ///< shown large; empty: nothing is wrong
  bool help = false;   ///< shows the keys

  /// As far as the panel shows them: two equal ones look alike.
  [[nodiscard]] OverlayFigures rounded() const;
  friend bool operator==(const OverlayFigures&, const OverlayFigures&) noexcept = default;
};

/// The panel over the picture, by Dear ImGui; it takes no input, so it needs no window. One at a
/// time, on the thread of the GL context.
class Overlay {
 public:
  Overlay();
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  void draw(const OverlayFigures& figures, const RenderTarget& target);
};

}  // namespace kerf
