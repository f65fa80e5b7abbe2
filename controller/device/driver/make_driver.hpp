// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "controller/device/driver/device_driver.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// The driver of a device; `port` outlives it.
[[nodiscard]] std::unique_ptr<DeviceDriver> make_driver(Personality personality, PacketPort& port);

}  // namespace kerf
