// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "shared/numeric/energy_source.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {

/// The column of each `EnergySource` in a tick record, in mJ with 32 fraction bits.
inline constexpr std::array<std::int64_t TickRecord::*, kEnergySources> kEnergyColumns = {
    &TickRecord::energy_spring,  &TickRecord::energy_damping,   &TickRecord::energy_friction,
    &TickRecord::energy_cutting, &TickRecord::energy_limits,    &TickRecord::energy_hold,
    &TickRecord::energy_leak,    &TickRecord::energy_stabiliser};

}  // namespace kerf
