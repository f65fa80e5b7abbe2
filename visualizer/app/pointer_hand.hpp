// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "shared/wire/hand_wish.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/view/camera.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// Where the hand wants to be, as the pointer says it.
///
/// The goal is a point of the world. It moves with the pointer in the plane through it that faces
/// the eye, and along the ray from the eye with wheel, keys and sticks; while the left button is
/// down it lies `kPressMm` deeper. It stands under the pointer, at the tool's own depth, when the
/// pointer, its wheel or its button is first used, when the pointer comes from outside or from a
/// panel, and again on `come`. A camera that turns or moves leaves it where it is. Lengths below
/// are mm of the hand: of the world, times the scene's scale.
class PointerHand {
 public:
  static constexpr double kWheelMm = 0.25;   ///< a notch
  static constexpr double kPressMm = 3.0;    ///< at the emulated grip, 0.5 N/mm, up to 1.5 N
  static constexpr double kHeldMmPerS = 20;  ///< keys and sticks
  static constexpr double kHeldRadPerS = 0.8;
  static constexpr double kMostAheadMm = 15;  ///< deeper than the tool: nobody winds back more

  /// One frame that lasts `frame_s`. `over_panel`: the pointer is a panel's. `tool_mm`: where the
  /// tool is seen.
  void step(const WindowInput& input, bool over_panel, const View& view, PictureSize size,
            const glm::dvec3& tool_mm, const DeviceFrame& device, double frame_s);
  /// The goal goes back under the pointer.
  void come() noexcept { under_pointer_ = false; }

  /// Whether the user holds the hand: the pointer is over the window, or a gamepad came after it.
  [[nodiscard]] bool leads() const noexcept { return leads_ && goal_mm_.has_value(); }
  /// With what the left button adds; none before the pointer came.
  [[nodiscard]] std::optional<glm::dvec3> goal_mm() const;
  [[nodiscard]] HandWish wish(const DeviceFrame& device) const;

 private:
  std::optional<glm::dvec3> goal_mm_;
  glm::dvec3 press_mm_{0.0};
  glm::dvec2 tilt_rad_{0.0};
  bool under_pointer_ = false;  ///< since the pointer came
  bool leads_ = false, by_pad_ = false;
};

}  // namespace kerf
