// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "hil/device/plant_params.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// A step of a hand script. Lengths in script units (`HandScript::unit_mm`), in the
/// device frame; the origin is the surface point under the tool.
struct HandStep {
  enum class Kind : std::uint8_t {
    move,    ///< to `to`
    hold,    ///< stay
    circle,  ///< around here in the horizontal plane, out to `size[0]` and back
    zigzag   ///< around here: `turns` strokes of width `size[0]` (x) while z covers `size[1]`
  };
  enum class Ease : std::uint8_t {
    smooth,  ///< minimum jerk: starts and ends at rest
    linear   ///< constant speed
  };

  Kind kind = Kind::hold;
  double seconds = 1.0;
  Ease ease = Ease::smooth;
  std::array<double, 3> to{};
  std::array<double, 2> size{};
  double turns = 1.0;
  double sink = 0.0;                                     ///< circle, zigzag: ends this much lower
  std::optional<std::array<double, 3>> orientation_rad;  ///< reached at the end of the step
  int button = 0;                                        ///< 1 or 2: pressed during the step
};

/// A scripted hand.
struct HandScript {
  std::optional<double> unit_mm{};       ///< device mm per script unit; if empty, the scene's, or 1
  std::array<double, 3> start{0, 5, 0};  ///< first point above the surface
  std::vector<HandStep> steps;
  std::optional<std::size_t> repeat_from;  ///< after the last step go on here; empty: stay
  PlantValues plant;                       ///< of the device and the hand that the script is for
};

/// The route of a hand from the device's rest pose to the start of a script. Device mm.
struct HandRoute {
  DeviceVec<double> rest_tip_mm;
  /// Motions that calibrate the device. Empty: the hand stays at rest and presses the calibration
  /// button, if there is one.
  std::vector<HandStep> calibration;
  /// A detour clear of the workpiece. Empty: straight to the start.
  struct Detour {
    double lift_mm;  ///< straight up from the rest first
    double y_mm;     ///< then over at this height or the start's, whichever is higher ...
    double z_mm;     ///< ... to this depth, and from there to the start
  };
  std::optional<Detour> detour;
  /// The first button of a script is the device's way to park (Falcon), so a led hand has its pedal
  /// at the second.
  bool first_button_parks = false;
  /// Of the hand's own spring with its load: `PlantParams::hand_rad_per_s`.
  double hand_rad_per_s = PlantParams().hand_rad_per_s();
};

/// A smooth move.
[[nodiscard]] inline HandStep hand_move(DeviceVec<double> to_mm, double seconds) {
  HandStep step;
  step.kind = HandStep::Kind::move;
  step.seconds = seconds;
  step.to = {to_mm.x, to_mm.y, to_mm.z};
  return step;
}

/// The goal of the hand during one bus cycle.
struct HandGoal {
  /// The arm rests (or shall come to rest) in its inkwell; one that has none, in its rest pose.
  bool in_inkwell = true;
  DeviceVec<double> target_mm;  ///< ignored in the inkwell
  /// Gimbal yaw, pitch, roll in rad; the pitch counts from an upright shaft.
  std::array<double, 3> orientation_rad{};
  bool button1 = false;
  bool button2 = false;
  bool calibrate = false;  ///< presses the calibration button of a device that has one
};

}  // namespace kerf
