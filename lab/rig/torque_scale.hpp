// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hil/devmodel/falcon_model.hpp"
#include "hil/devmodel/omni_model.hpp"
#include "hil/devmodel/wooden_model.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// N mm per motor count of the emulated unit: a scene's `device.torque_scale`.
[[nodiscard]] inline std::array<double, 3> torque_scale_of(Personality personality) {
  switch (personality) {
    case Personality::falcon:
      return FalconParams().torque_scale();
    case Personality::woodenhaptics:
      return WoodenParams().torque_scale();
    case Personality::omni:
      break;
  }
  return OmniParams().torque_scale();
}

}  // namespace kerf
