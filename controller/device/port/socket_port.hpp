// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "shared/wire/emulator_link.hpp"

// Ports to an emulator: Unix socket, UDP, and lock-step over either.

namespace kerf {

/// A packet port over a Unix SEQPACKET socket: one datagram is one packet of the bus.
class SocketPort : public PacketPort {
 public:
  /// Connects, and retries for `patience_ms` while no process listens, or until `stop`. Throws
  /// std::runtime_error with one line if that fails.
  SocketPort(const std::filesystem::path& path, int patience_ms, const std::atomic<bool>& stop);
  ~SocketPort() override;
  SocketPort(const SocketPort&) = delete;
  SocketPort& operator=(const SocketPort&) = delete;

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override;
  bool send(std::span<const std::uint8_t> packet) noexcept override;
  [[nodiscard]] bool closed() const noexcept override {
    return closed_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool wait(int milliseconds) noexcept override;

 protected:
  /// Takes over a connected, non-blocking socket.
  explicit SocketPort(int fd) noexcept : fd_(fd) {}

 private:
  int fd_ = -1;
  std::atomic<bool> closed_{false};  ///< written by any thread that finds the end
};

/// A packet port over UDP, to an emulator on another machine: each datagram is one packet. A
/// datagram that the network loses, delays or repeats is a lost, late or repeated packet to the
/// driver. An empty datagram is the greeting, and the goodbye.
///
/// Only the address of the peer is checked: for networks without other senders.
class UdpPort final : public SocketPort {
 public:
  /// `where`: see resolve_udp. Retries for `patience_ms` while the other machine refuses, or
  /// until `stop`; a silent one counts as a device that waits for its host. Throws
  /// std::runtime_error with one line.
  UdpPort(const std::string& where, int patience_ms, const std::atomic<bool>& stop);
  ~UdpPort() override;
};

/// A port to an emulator in lock-step: splits the packets of one turn (`Turn`). After the last
/// one there is none until `wait` has received the next turn, so the speed of the emulator changes
/// nothing. A packet without a turn passes unchanged.
class LockStepPort final : public PacketPort {
 public:
  explicit LockStepPort(std::unique_ptr<PacketPort> port) : port_(std::move(port)) {}

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
