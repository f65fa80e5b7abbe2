// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "hil/devmodel/packet_device.hpp"
#include "hil/front/packet_link.hpp"
#include "shared/numeric/histogram.hpp"

namespace kerf {

/// What both ways of serving share.
struct ServeLimits {
  std::int64_t cycles = 0;  ///< bus cycles to serve in all; 0 = until the client leaves
  const std::atomic<bool>& stop;
};

/// What the front saw.
struct FrontStats {
  std::uint64_t sent = 0;
  std::uint64_t dropped = 0;  ///< the client did not read
  std::uint64_t resyncs = 0;  ///< the process slept so long that time was skipped
  std::int64_t cycles = 0;
  Histogram wake;
};

/// Serves one client in real time: every `packet_cycles` bus cycles, at absolute deadlines, the
/// packets of the host are applied and the device's packet is sent, where one is due. Never waits
/// for the client: what it does not read is dropped and counted. Returns when the client leaves, at
/// the limit or at a stop.
void serve_real_time(PacketLink& client, PacketDevice& device, int packet_cycles,
                     const ServeLimits& limits, FrontStats& stats);

/// Serves one client in lock-step: one packet at once (of a device that speaks first), then for
/// every packet of the host `tick_cycles` bus cycles and the packet that is due then. No clock: the
/// same host sees the same bytes.
void serve_lockstep(PacketLink& client, PacketDevice& device, int tick_cycles,
                    const ServeLimits& limits, FrontStats& stats);

}  // namespace kerf
