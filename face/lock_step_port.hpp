// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "hil/device/packet_device.hpp"
#include "lab/rig/direct_port.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// A DirectPort in lock-step: each packet that the driver sends advances the device by one tick, as
/// `serve_lockstep` does over a socket. `device` outlives it.
class DirectLockStepPort final : public DirectPort {
 public:
  DirectLockStepPort(PacketDevice& device, Personality personality, int rate_hz)
      : DirectPort(device), tick_cycles_(kCyclesPerSecond / rate_hz) {
    // The packets of such a device come before any of the host.
    if (kind_of(personality).streams) take_packets();
  }

  bool send(std::span<const std::uint8_t> packet) noexcept override {
    const bool is_sent = DirectPort::send(packet);
    cycle(tick_cycles_);
    return is_sent;
  }

 private:
  int tick_cycles_;
};

}  // namespace kerf
