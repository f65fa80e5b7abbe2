// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hil/devmodel/hand_script.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// How a hand gets a device from rest to the start of a script. Device mm and seconds.
struct HandRoute {
  DeviceVec<double> rest_tip_mm;
  /// Motions that calibrate the device. Empty: the hand stays at rest and presses the calibration
  /// button, where there is one.
  std::vector<HandStep> calibration;
  /// Then straight up ...
  double lift_mm = 0;  ///< 0: not at all
  double lift_s = 0.15;
  /// ... at this height or the start's, whichever is higher, over to this depth, clear of the
  /// workpiece ...
  double clear_y_mm = 15;
  double clear_z_mm = 0;
  double cross_s = 0.4;  ///< 0: not at all
  /// ... and on to the start.
  double approach_s = 0.25;
};

/// A smooth move.
[[nodiscard]] inline HandStep hand_move(DeviceVec<double> to_mm, double seconds) {
  HandStep step;
  step.kind = HandStep::Kind::move;
  step.seconds = seconds;
  step.to = {to_mm.x, to_mm.y, to_mm.z};
  return step;
}

}  // namespace kerf
