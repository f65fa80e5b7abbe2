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

namespace kerf {

/// The port to an emulated device in the same process and thread. `device` outlives it.
///
/// The caller advances the device, by `cycle`. Packets of the device wait here, without bound,
/// until `receive` takes them, the oldest first. A packet of the host reaches the device at once.
class DirectPort : public PacketPort {
 public:
  explicit DirectPort(PacketDevice& device) : device_(device) {}

  /// Advances the device by `cycles` of its bus, and takes the packets that are due then.
  void cycle(int cycles = 1) {
    device_.advance(cycles);
    take_packets();
  }
  /// Takes the packets that are due now.
  void take_packets() {
    for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
      waiting_.emplace_back(packet.begin(), packet.end());
    }
  }

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept final {
    if (waiting_.empty()) return 0;
    const std::vector<std::uint8_t> packet = std::move(waiting_.front());
    waiting_.pop_front();
    std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
    return packet.size();
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    device_.receive(packet);
    return true;
  }
  [[nodiscard]] bool closed() const noexcept final { return waiting_.empty() && device_.hung_up(); }
  [[nodiscard]] bool wait(int) noexcept final { return !waiting_.empty(); }

 private:
  PacketDevice& device_;
  std::deque<std::vector<std::uint8_t>> waiting_;
};

}  // namespace kerf
