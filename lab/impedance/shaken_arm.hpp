// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/load/loaded_scene.hpp"
#include "lab/impedance/stepped_sine.hpp"
#include "lab/stability/axes.hpp"

namespace kerf::impedance {

/// The wall of the whole loop: servo step, driver and emulated device in virtual time, on
/// `zwidth::walls_scene`. A stiff hand without mass holds the tip and shakes it along the wall's
/// normal. `wall` is the force of the motors over the velocity of the true tip; `port` is that of
/// the hand, so it has the device's mass and friction by its mechanics. The subject's hand does not
/// count. Throws HilError, also if the device was lost or the tip left the wall.
[[nodiscard]] SineResult measure_arm(const LoadedScene& walls, const zwidth::LoopCase& subject,
                                     double stiffness_n_per_mm, double hz, double most_mm);

}  // namespace kerf::impedance
