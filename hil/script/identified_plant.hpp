// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hil/device/plant_params.hpp"
#include "shared/device/identified_device.hpp"

namespace kerf {

/// An identified device as the mechanics of an emulated one, whose mass, viscous and Coulomb
/// friction are alike in all directions: the mass that a force of any direction moves as far in the
/// mean, 3 / tr M^-1, and the means of both frictions. `own_delay_s`: what the emulated device is
/// late anyway, a period in lock-step and nothing in real time; the rest of the delay, if it is
/// longer, is whole bus cycles from a command to its torque.
///
/// Encoders, weight and structural mode stay those of the emulated device. Throws HilError, with
/// `file`, for what no emulated device can have.
[[nodiscard]] PlantValues plant_of(const IdentifiedDevice& device, double own_delay_s,
                                   const std::string& file);

}  // namespace kerf
