// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "controller/servo/device_report.hpp"

namespace kerf::ranges {

/// What the servo must have come to after a tick.
struct Mark {
  enum class Kind { active, faded, armed } kind;
  std::size_t tick;
};

/// Reports of a hand that does all that hands and devices do to a servo, for one scene: it parks,
/// leaves, presses, slides and turns, loses reports, says the same twice, jumps, says nonsense,
/// falls silent, and recovers from all of that by parking, twice. Ends in a press.
struct HardHand {
  std::vector<DeviceReport> reports;
  std::vector<Mark> marks;
  std::size_t recovered = 0;  ///< tick after the last disturbance at which it is armed again
};

/// `scene` with volumes. Some 0.75 s of its rate. The start lies above what the device's origin
/// touches; the press goes three voxels into it, or as deep as the speed limit allows.
[[nodiscard]] HardHand hard_hand(const LoadedScene& scene);

}  // namespace kerf::ranges
