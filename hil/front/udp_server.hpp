// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include <sys/socket.h>

#include "hil/front/serving.hpp"

namespace kerf {

/// One host at a UDP port, for emulators on another machine: each datagram is one packet of the
/// device, without any framing. Datagrams of other senders are ignored. The host is gone when it
/// sends an empty datagram, or nothing for 2 s. UDP may lose packets: in real time the next one
/// makes good, in lock-step both sides would wait.
class UdpLink final : public PacketLink {
 public:
  /// `fd` is the server's.
  UdpLink(int fd, const sockaddr_storage& host, socklen_t host_bytes) noexcept;

  [[nodiscard]] std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept override;
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept override;

 private:
  sockaddr_storage host_;
  socklen_t host_bytes_;
  std::int64_t heard_ns_;
};

/// A UDP port that waits for hosts. Whoever reaches it may be the host, so it listens on this
/// machine alone unless told otherwise.
class UdpServer {
 public:
  /// `where` is [ADDRESS:]PORT; address 127.0.0.1 unless given, port 0 = any free one. Throws
  /// `HilError`.
  explicit UdpServer(const std::string& where);
  UdpServer(const UdpServer&) = delete;
  UdpServer& operator=(const UdpServer&) = delete;
  ~UdpServer();

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// Waits for the first datagram of a host, empty or not; nothing when `stop` became true, or for
  /// so long. The link must not outlive the server.
  [[nodiscard]] std::optional<UdpLink> accept(const std::atomic<bool>& stop,
                                              std::int64_t patience_ns = kForeverNs);

 private:
  int fd_ = -1;
};

}  // namespace kerf
