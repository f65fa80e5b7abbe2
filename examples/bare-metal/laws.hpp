// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/law/law.hpp"
#include "controller/law/stabilisers.hpp"
#include "controller/law/velocity_estimators.hpp"
#include "controller/law/virtual_coupling.hpp"

// The laws by symbols of the image: a plan points to the step of its laws. One line for each law of
// a scene; a law of your own is one more (docs/own-law.md).

#define KERF_BARE_LAWS(LAW)                                     \
  LAW(kerf_law_coupling, CouplingLaw, ForceInput)               \
  LAW(kerf_law_foaw, Foaw, VelocityInput)                       \
  LAW(kerf_law_difference, Difference, VelocityInput)           \
  LAW(kerf_law_passivity, PassivityController, StabiliserInput) \
  LAW(kerf_law_energy_bounding, EnergyBounding, StabiliserInput)
