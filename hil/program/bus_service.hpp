// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <iosfwd>

#include "hil/devmodel/packet_device.hpp"
#include "hil/front/socket.hpp"

namespace kerf {

/// A device that is served on a bus, and when that ends: at a stop, at the limit of bus cycles, or
/// once its client is gone.
struct BusService {
  PacketDevice& device;
  const ServeLimits& limits;
  bool stay = false;  ///< go on when the client is gone
  FrontStats& stats;
  std::ostream& out;  ///< is told where the device is

  /// Whether to serve on after `cycles` bus cycles; `left`: the client that used the device is
  /// gone.
  [[nodiscard]] bool goes_on(std::int64_t cycles, bool left) const {
    stats.cycles = cycles;
    return !limits.stop.load(std::memory_order_relaxed) && (stay || !left) &&
           (limits.cycles == 0 || cycles < limits.cycles);
  }
};

}  // namespace kerf
