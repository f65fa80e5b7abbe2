// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>

#include "controller/device/port/packet_port.hpp"

namespace kerf {

/// A packet port over a Unix SEQPACKET socket: one datagram is one packet of the bus.
class SocketPort : public PacketPort {
 public:
  /// Connects, trying again for `patience_ms` while nobody listens, or until `stop`. Throws
  /// std::runtime_error with one line when nobody does.
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
  /// Over a socket that is connected already, and does not block.
  explicit SocketPort(int fd) noexcept : fd_(fd) {}

 private:
  int fd_ = -1;
  std::atomic<bool> closed_{false};  ///< written by whoever meets the end first
};

}  // namespace kerf
