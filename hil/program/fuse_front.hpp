// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/usb/ftdi_falcon.hpp"
#include "hil/front/usb/usb_fault.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "hil/program/bus_service.hpp"

namespace kerf {

// `--front fuse`: the device node of a device in the folder `mount`. Each throws `HilError` where
// nothing can be mounted.
void serve_fuse(const BusService& service, const std::string& mount, const FirewireSettings& omni);
void serve_fuse(const BusService& service, const std::string& mount,
                const FtdiFalcon::Settings& falcon, std::vector<ScriptedUsbFault> script);
void serve_fuse(const BusService& service, const std::string& mount,
                const WoodenHid::Settings& wooden);

}  // namespace kerf
