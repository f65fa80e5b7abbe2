// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/hid/hidraw_node.hpp"
#include "hil/front/packet_device.hpp"
#include "hil/front/socket.hpp"
#include "hil/front/usb/ftdi_falcon.hpp"

namespace CLI {
class App;
}

namespace kerf {

/// What `--front fuse` takes from the command line.
struct FuseFrontOptions {
  std::string mount;
  int packet_hz = 8000;
  double drift_ppm = 0;
  bool reset_stops_stream = false;
  bool firmware_runs = false;
  std::vector<std::string> bus_faults;  ///< SECONDS:KIND
};

void declare_fuse(CLI::App& app, FuseFrontOptions& options);

/// Throws `HilError` for what no bus can be. `lockstep_hz`: servo rate in lock-step, 0 = real time.
[[nodiscard]] FirewireSettings firewire_settings(const FuseFrontOptions& options, int lockstep_hz);

/// The same for the other two devices' buses, which have no lock-step.
[[nodiscard]] std::vector<ScriptedUsbFault> usb_script(const FuseFrontOptions& options);

/// The node of a device in a mounted folder, and how long it is served.
struct FuseService {
  std::string mount;
  PacketDevice& device;
  const ServeLimits& limits;
  bool stay = false;  ///< else only until the client that used it is gone
  FrontStats& stats;
  std::ostream& out;  ///< hears where it is
};
void serve_fuse(const FuseService& service, const FirewireSettings& omni);
void serve_fuse(const FuseService& service, const FtdiFalcon::Settings& falcon,
                std::vector<ScriptedUsbFault> script);
void serve_fuse(const FuseService& service, const HidrawNode::Settings& wooden);

}  // namespace kerf
