// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hil/devmodel/omni_model.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf::test {

inline constexpr int kSecond = omni::kBusCyclesPerSecond;

/// A hand out of the inkwell that wants to be at `target_mm`.
inline HandGoal at(DeviceVec<double> target_mm) {
  HandGoal goal;
  goal.in_inkwell = false;
  goal.target_mm = target_mm;
  return goal;
}

inline void run(OmniModel& model, const HandGoal& goal, int cycles) {
  for (int i = 0; i < cycles; ++i) model.step(goal);
}

}  // namespace kerf::test
