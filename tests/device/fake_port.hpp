// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "controller/device/port/packet_port.hpp"

namespace kerf::test {

/// A bus in memory.
class FakePort final : public PacketPort {
 public:
  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    ++receive_calls;
    if (incoming.empty()) return 0;
    const std::vector<std::uint8_t> packet = incoming.front();
    incoming.pop_front();
    std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
    return packet.size();
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    if (before_send) before_send();
    sent.emplace_back(packet.begin(), packet.end());
    return true;
  }
  bool send_now(std::span<const std::uint8_t> packet) noexcept override {
    ++sent_now;
    return send(packet);
  }
  bool closed() const noexcept override { return gone; }
  bool wait(int) noexcept override { return !incoming.empty(); }

  /// A packet of the device that waits to be received.
  void push(std::span<const std::uint8_t> packet) {
    incoming.emplace_back(packet.begin(), packet.end());
  }

  std::deque<std::vector<std::uint8_t>> incoming;
  std::vector<std::vector<std::uint8_t>> sent;
  int sent_now = 0;  ///< of these, out of turn
  int receive_calls = 0;
  bool gone = false;  ///< the other end
  std::function<void()> before_send;
};

}  // namespace kerf::test
