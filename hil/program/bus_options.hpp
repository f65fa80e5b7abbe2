// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/usb/usb_fault.hpp"
#include "shared/text/command_line.hpp"

namespace kerf {

/// What the fronts that speak for a whole bus (fuse, usbip, uhid) take from the command line.
struct BusOptions {
  std::string mount;
  int packet_hz = 8000;
  double drift_ppm = 0;
  bool reset_stops_stream = false;
  bool firmware_runs = false;
  std::vector<std::string> faults;  ///< SECONDS:KIND
};

void declare_bus(Arguments& app, BusOptions& options);

/// Throws `HilError` for what no bus can be. `lockstep_hz`: servo rate in lock-step, 0 = real time.
[[nodiscard]] FirewireSettings firewire_settings(const BusOptions& options, int lockstep_hz);

/// The same for the other two devices' buses, which have no lock-step.
[[nodiscard]] std::vector<ScriptedUsbFault> usb_script(const BusOptions& options);

}  // namespace kerf
