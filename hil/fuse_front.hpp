// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/packet_device.hpp"
#include "hil/front/socket.hpp"

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
  std::vector<std::string> bus_faults;  ///< SECONDS:KIND
};

void declare_fuse(CLI::App& app, FuseFrontOptions& options);

/// Throws `HilError` for what no bus can be. `lockstep_hz`: servo rate in lock-step, 0 = real time.
[[nodiscard]] FirewireSettings firewire_settings(const FuseFrontOptions& options, int lockstep_hz);

/// Serves the device as the node `fw1` in the folder `mount` until a stop, the limit, or, unless
/// `stay`, until the client that had streams is gone. `out` hears where it is.
void serve_fuse(const std::string& mount, const FirewireSettings& settings, PacketDevice& device,
                const ServeLimits& limits, bool stay, FrontStats& stats, std::ostream& out);

}  // namespace kerf
