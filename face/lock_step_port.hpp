// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "hil/device/packet_device.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// Controller and emulated device in one thread, in lock-step: each packet that the driver sends
/// takes the device one tick further, as `serve_lockstep` does over a socket.
class LockStepPort final : public PacketPort {
 public:
  /// `device` outlives it.
  LockStepPort(PacketDevice& device, Personality personality, int rate_hz)
      : LockStepPort(device, kCyclesPerSecond / rate_hz, kind_of(personality).streams) {}
  /// `device_first`: its packet comes before any of the host.
  LockStepPort(PacketDevice& device, int tick_cycles, bool device_first)
      : device_(device), tick_cycles_(tick_cycles) {
    if (device_first) collect();
  }

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    if (waiting_.empty()) return 0;
    const std::vector<std::uint8_t> packet = std::move(waiting_.front());
    waiting_.pop_front();
    std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
    return packet.size();
  }

  bool send(std::span<const std::uint8_t> packet) noexcept override {
    device_.receive(packet);
    device_.advance(tick_cycles_);
    collect();
    return true;
  }

  [[nodiscard]] bool closed() const noexcept override { return false; }
  [[nodiscard]] bool wait(int) noexcept override { return !waiting_.empty(); }

 private:
  void collect() {
    for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
      waiting_.emplace_back(packet.begin(), packet.end());
    }
  }

  PacketDevice& device_;
  int tick_cycles_;
  std::deque<std::vector<std::uint8_t>> waiting_;
};

}  // namespace kerf
