// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "shared/wire/turn.hpp"

namespace kerf {

/// A port to an emulator in lock-step: takes the packets of one turn (turn.hpp) apart. After the
/// last one there is none until `wait` has heard of the next turn, so how fast the emulator answers
/// changes nothing. What comes without a turn passes as it is.
class TurnPort final : public PacketPort {
 public:
  explicit TurnPort(std::unique_ptr<PacketPort> port) : port_(std::move(port)) {}

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    if (!in_turn_) {
      const std::size_t size = port_->receive(datagram_);
      const auto bytes = std::span(datagram_).first(std::min(size, datagram_.size()));
      if (!Turn::is_turn(bytes)) return copy(bytes, size, out);
      in_turn_ = true;
      rest_ = bytes.subspan(Turn::kMagic.size());
    }
    const auto packet = Turn::next(rest_);
    return copy(packet, packet.size(), out);
  }
  [[nodiscard]] bool wait(int milliseconds) noexcept override {
    in_turn_ = false;
    return port_->wait(milliseconds);
  }

  bool send(std::span<const std::uint8_t> packet) noexcept override { return port_->send(packet); }
  bool send_now(std::span<const std::uint8_t> packet) noexcept override {
    return port_->send_now(packet);
  }
  bool send_last(std::span<const std::uint8_t> packet) noexcept override {
    return port_->send_last(packet);
  }
  [[nodiscard]] bool closed() const noexcept override { return port_->closed(); }
  [[nodiscard]] std::vector<LinkCounter> counters() const override { return port_->counters(); }

 private:
  static std::size_t copy(std::span<const std::uint8_t> packet, std::size_t size,
                          std::span<std::uint8_t> out) noexcept {
    std::copy_n(packet.begin(), std::min(packet.size(), out.size()), out.begin());
    return size;
  }

  std::unique_ptr<PacketPort> port_;
  std::array<std::uint8_t, Turn::kMostBytes> datagram_{};
  std::span<const std::uint8_t> rest_;
  bool in_turn_ = false;  ///< until the next wait
};

}  // namespace kerf
