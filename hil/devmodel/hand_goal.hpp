// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "shared/numeric/vec.hpp"

namespace kerf {

/// What the hand wants during one bus cycle.
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
