// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <iosfwd>
#include <string>

#include "lab/stability/axes.hpp"
#include "shared/device/identified_device.hpp"

namespace kerf::zwidth {

/// "x", "y", "z", "1,0,0", or "worst": `worst_direction` at this damping and rate, and
/// the peak of a scene that sets none. Throws HilError
/// for another text.
[[nodiscard]] DeviceDirection direction_of(const IdentifiedDevice& device, const std::string& text,
                                           double damping_ns_per_mm, double rate_hz);

/// Gives a map those axes of the device in a file of `kerf identify`, in this direction, that
/// `texts` leaves empty: mass, viscous, friction, quantum, delay. `texts` has one value of each
/// axis that the delay in periods needs, the rate, or none. Throws HilError.
[[nodiscard]] DeviceDirection take_device(const std::string& file, const std::string& direction,
                                          std::array<std::string, kAxisCount>& texts);

/// If `texts` have a file behind --device, puts its axes there in place of its name, as
/// `take_device`, and prints one line about them. `direction`: of --direction, empty: worst. Throws
/// HilError, also for a direction without a file, and for the whole arm (`arm`), which is emulated.
void take_device_option(const std::string& direction, bool arm,
                        std::array<std::string, kAxisCount>& texts, std::ostream& out);

}  // namespace kerf::zwidth
