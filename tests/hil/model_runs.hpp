// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include <rapidcheck.h>

#include "hil/device/device_model.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"

namespace kerf::test {

inline constexpr int kSecond = kCyclesPerSecond;

/// A hand out of the inkwell that wants to be at `target_mm`.
inline HandGoal at(DeviceVec<double> target_mm) {
  HandGoal goal;
  goal.in_inkwell = false;
  goal.target_mm = target_mm;
  return goal;
}

inline void run(DeviceModel& model, const HandGoal& goal, int cycles) {
  for (int i = 0; i < cycles; ++i) model.step(goal);
}

/// A command with the motors on.
inline void push(OmniModel& model, std::array<std::int16_t, 3> counts) {
  model.command({counts, true, OmniCommand::Light::steady});
}
inline void push(FalconModel& model, std::array<std::int16_t, 3> counts) {
  model.command({counts, false, true, false, false});
}
inline void push(WoodenModel& model, std::array<std::int16_t, 3> milliamps) {
  model.command({milliamps, std::nullopt});
}

/// Any position in a ball around the origin.
inline DeviceVec<double> any_in_ball(double radius_mm) {
  const auto part = [] { return *rc::gen::inRange(-1000, 1001) * 1e-3; };
  const DeviceVec<double> in_cube{part(), part(), part()};
  return in_cube * (radius_mm / std::max(1.0, norm(in_cube)));
}

/// Joint torques that do the work of a tip force, J' F, by differences of the forward kinematics.
template <class Arm>
JointVec<double> torque_by_differences(const Arm& arm, JointVec<double> q,
                                       DeviceVec<double> force_n) {
  constexpr double kStepRad = 1e-4;
  const auto along = [&](JointVec<double> unit) {
    return dot(arm.tip_mm(q + unit * kStepRad) - arm.tip_mm(q - unit * kStepRad), force_n) *
           (0.5 / kStepRad);
  };
  return {along({1, 0, 0}), along({0, 1, 0}), along({0, 0, 1})};
}

}  // namespace kerf::test
