// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "include/kerf/stability.hpp"
#include "shared/device/identified_device.hpp"

// The loop of an identified device on a virtual wall (include/kerf/stability.hpp).

namespace kerf {

/// The loop across `direction`, without a hand. With `at_worst` friction and delay are the
/// unfavourable ends of their intervals, for checks; the mass is as found: its interval moves a
/// boundary less than these do.
[[nodiscard]] SampledLoop loop_along(const IdentifiedDevice& device,
                                     const DeviceDirection& direction, double rate_hz,
                                     bool at_worst);

/// About the lowest stiffness, N/mm, that any push makes oscillate on a device with friction whose
/// motors give `peak_n` (docs/forces.md 5.7, with the exact boundary in place of b/(T/2 + td)).
/// With an infinite peak, or without friction, the exact linear boundary.
[[nodiscard]] double pushed_stiffness(const SampledLoop& loop, double damping_ns_per_mm,
                                      double peak_n);

/// The direction with the lowest `pushed_stiffness` at this damping and rate, within 0.1 degrees:
/// searched from the lowest of the 13 axes and diagonals of a cube. Load time.
[[nodiscard]] DeviceDirection worst_direction(
    const IdentifiedDevice& device, double damping_ns_per_mm, double rate_hz,
    double peak_n = std::numeric_limits<double>::infinity());

}  // namespace kerf
