// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <iosfwd>

#include "hil/front/packet_device.hpp"
#include "hil/front/socket.hpp"

namespace kerf {

/// A device on a bus, and how long it is served there.
struct BusService {
  PacketDevice& device;
  const ServeLimits& limits;
  bool stay = false;  ///< else only until the client that used it is gone
  FrontStats& stats;
  std::ostream& out;  ///< hears where it is

  /// After so many bus cycles; `left`: the client that used it is gone.
  [[nodiscard]] bool goes_on(std::int64_t cycles, bool left) const {
    stats.cycles = cycles;
    return !limits.stop.load(std::memory_order_relaxed) && (stay || !left) &&
           (limits.cycles == 0 || cycles < limits.cycles);
  }
};

}  // namespace kerf
