// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <sys/socket.h>

#include "hil/front/serving.hpp"

/// Sockets at which an emulated device waits for its host: a Unix socket, or a UDP port.
namespace kerf {

/// One end of a SEQPACKET Unix socket: whole packets, in order, none merged. Owns the descriptor.
class SeqpacketLink final : public PacketLink {
 public:
  explicit SeqpacketLink(int fd) noexcept : PacketLink(fd) {}
  SeqpacketLink(SeqpacketLink&& other) noexcept;
  SeqpacketLink& operator=(SeqpacketLink&&) = delete;
  ~SeqpacketLink() override;

  [[nodiscard]] std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept override;
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept override;
  void hang_up() noexcept override;
};

/// A listening socket at a path of the file system.
///
/// The path appears in one step, ready to accept. A socket file without a listener is replaced; a
/// live one, or a file of another kind, throws `HilError` that names `option`. The path is removed
/// at the end.
class SeqpacketServer {
 public:
  explicit SeqpacketServer(std::string path, const char* option = "--socket");
  SeqpacketServer(const SeqpacketServer&) = delete;
  SeqpacketServer& operator=(const SeqpacketServer&) = delete;
  ~SeqpacketServer();

  /// Waits for a client of this user or of root; empty if `stop` became true or the time is over.
  /// Another user is refused, with a line on stderr.
  [[nodiscard]] std::optional<SeqpacketLink> accept(const std::atomic<bool>& stop,
                                                    std::int64_t patience_ns = kForeverNs);
  /// A client that waits already; else empty, and errno is set if it could not be accepted.
  [[nodiscard]] std::optional<SeqpacketLink> accept_waiting() noexcept;

 private:
  std::string path_;
  const char* option_;
  int fd_ = -1;
};

/// One host at a UDP port, for emulators on another machine: each datagram is one packet of the
/// device, without any framing. Datagrams of other senders are ignored. The host is gone if it
/// sends an empty datagram, or nothing for 2 s. UDP may lose packets: in real time the next one
/// makes up for it, in lock-step both sides would wait.
class UdpLink final : public PacketLink {
 public:
  /// `fd` is the server's.
  UdpLink(int fd, const sockaddr_storage& host, socklen_t host_bytes) noexcept;

  [[nodiscard]] std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept override;
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept override;
  void hang_up() noexcept override;

 private:
  sockaddr_storage host_;
  socklen_t host_bytes_;
  std::int64_t heard_ns_;
};

/// A UDP port that waits for hosts. Any peer that reaches it may be the host, so by default it
/// listens on this machine alone.
class UdpServer {
 public:
  /// `where` is [ADDRESS:]PORT; address 127.0.0.1 unless given, port 0 = any free one. Throws
  /// `HilError`.
  explicit UdpServer(const std::string& where);
  UdpServer(const UdpServer&) = delete;
  UdpServer& operator=(const UdpServer&) = delete;
  ~UdpServer();

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// Waits for the first datagram of a host, empty or not; empty if `stop` became true or the time
  /// is over. The link must not outlive the server.
  [[nodiscard]] std::optional<UdpLink> accept(const std::atomic<bool>& stop,
                                              std::int64_t patience_ns = kForeverNs);

 private:
  int fd_ = -1;
};

}  // namespace kerf
