// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/falcon_usb.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "hil/program/emulated_device.hpp"

namespace kerf {

/// A device that is served on a bus, and when that ends: at a stop, at the limit of bus cycles,
/// once its client is gone, or if it was unused for the rest of the limit.
struct BusService {
  EmulatedDevice& device;
  const ServeLimits& limits;
  bool stay = false;  ///< go on when the client is gone
  FrontStats& stats;
  std::ostream& out;  ///< gets the device's path

  bool was_left = false;

  /// Whether to serve on after `cycles` bus cycles; `left`: the client that used the device is
  /// gone. For the next one it is renewed.
  [[nodiscard]] bool goes_on(std::int64_t cycles, bool left) {
    if (was_left && !left) device.renew();
    was_left = left;
    stats.cycles = cycles;
    return (stay || !left) && !limits.reached(cycles);
  }
};

// `--front fuse`: the device node of a device in the folder `mount`. Each throws `HilError` if
// nothing can be mounted.
void serve_fuse(BusService& service, const std::string& mount, const FirewireSettings& omni);
void serve_fuse(BusService& service, const std::string& mount, const FtdiFalcon::Settings& falcon,
                std::vector<ScriptedUsbFault> script);
void serve_fuse(BusService& service, const std::string& mount, const WoodenHid::Settings& wooden);

/// `--front usbip`: the Falcon at a virtual USB port of this machine's kernel. It stays until it is
/// stopped or its time is over, because USB/IP does not report that a program closes the device.
/// Throws `HilError` if the kernel cannot.
void serve_usbip(BusService& service, const FtdiFalcon::Settings& falcon,
                 std::vector<ScriptedUsbFault> script);

/// `--front uhid`: the WoodenHaptics arm in this machine's HID stack. Throws `HilError` likewise.
void serve_uhid(BusService& service, const WoodenHid::Settings& wooden);

}  // namespace kerf
