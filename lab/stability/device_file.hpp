// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "lab/stability/axes.hpp"
#include "shared/device/identified_device.hpp"

namespace kerf::zwidth {

/// "x", "y", "z", "1,0,0", or "worst": `worst_direction` at this damping and rate. Throws HilError
/// for another text.
[[nodiscard]] DeviceDirection direction_of(const IdentifiedDevice& device, const std::string& text,
                                           double damping_ns_per_mm, double rate_hz);

/// Gives a map those axes of the device in a file of `kerf identify`, in this direction, that
/// `texts` leaves empty: mass, viscous, friction, quantum, delay. `texts` has one value of each
/// axis that the delay in periods needs, the rate, or none. Throws HilError.
[[nodiscard]] DeviceDirection take_device(const std::string& file, const std::string& direction,
                                          std::array<std::string, kAxisCount>& texts);

}  // namespace kerf::zwidth
