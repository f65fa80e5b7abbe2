// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hil/front/usb/ftdi_falcon.hpp"
#include "hil/front/usb/usb_fault.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "hil/program/bus_service.hpp"

namespace kerf {

/// `--front usbip`: the Falcon at a virtual USB port of this machine's kernel. It stays until it is
/// stopped or its time is over, because USB/IP does not tell when a program lets go. Throws
/// `HilError` where the kernel cannot.
void serve_usbip(const BusService& service, const FtdiFalcon::Settings& falcon,
                 std::vector<ScriptedUsbFault> script);

/// `--front uhid`: the WoodenHaptics arm in this machine's HID stack. Throws `HilError` likewise.
void serve_uhid(const BusService& service, const WoodenHid::Settings& wooden);

}  // namespace kerf
