// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "shared/numeric/vec.hpp"

namespace kerf {

/// One pose of an arm, both ways: joint angles and tip that belong together.
struct ArmPose {
  JointVec<double> q;
  DeviceVec<double> tip_mm;
};

/// Takes away the part of `velocity` that drives a stopped angle further. `gradient` is the angle's
/// by the tip, `side` +1 above its range and -1 below: without friction, without bounce.
inline void stop_speed(DeviceVec<double>& velocity, DeviceVec<double> gradient, int side) noexcept {
  const double rate = dot(gradient, velocity);
  if (rate * side > 0) velocity = velocity - gradient * (rate / dot(gradient, gradient));
}

/// What an encoder shows: the floor of the angle in counts from its zero, then 16 bits.
[[nodiscard]] inline std::int16_t encoder_count(int at_zero, double counts) noexcept {
  return static_cast<std::int16_t>(
      static_cast<std::uint16_t>(at_zero + static_cast<int>(std::floor(counts))));
}

}  // namespace kerf
