// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "shared/wire/omni.hpp"

namespace kerf::test {

/// The host's end of a socket, as simple as it can be: SEQPACKET by path, UDP by port.
class FakeHost {
 public:
  /// Tries for 5 s.
  explicit FakeHost(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    for (int attempt = 0; attempt < 500 && !connected_; ++attempt) {
      join(AF_UNIX, SOCK_SEQPACKET, reinterpret_cast<const sockaddr*>(&address), sizeof address);
      if (!connected_) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  explicit FakeHost(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    join(AF_INET, SOCK_DGRAM, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  FakeHost(const FakeHost&) = delete;
  FakeHost& operator=(const FakeHost&) = delete;
  ~FakeHost() { leave(); }

  void leave() {
    if (connected_) close(fd_);
    connected_ = false;
  }
  [[nodiscard]] bool connected() const { return connected_; }

  void send(std::span<const std::uint8_t> packet) const {
    static_cast<void>(::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }
  void send(const OmniCommand& command) const {
    send(std::span<const std::uint8_t>(encode(command)));
  }

  /// The next packet within `timeout_ms`; empty on timeout, end, or an empty datagram.
  [[nodiscard]] std::vector<std::uint8_t> packet(int timeout_ms = 5000) {
    pollfd ready{fd_, POLLIN, 0};
    if (poll(&ready, 1, timeout_ms) <= 0) return {};
    std::vector<std::uint8_t> bytes(128);
    const ssize_t size = recv(fd_, bytes.data(), bytes.size(), 0);
    ended_ = size <= 0;
    bytes.resize(ended_ ? 0 : static_cast<std::size_t>(size));
    return bytes;
  }
  /// The same of an Omni; empty if it is no report.
  [[nodiscard]] std::optional<OmniReport> receive(int timeout_ms = 5000) {
    return decode_report(packet(timeout_ms));
  }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  void join(int family, int type, const sockaddr* address, socklen_t size) {
    fd_ = socket(family, type, 0);
    connected_ = connect(fd_, address, size) == 0;
    if (!connected_) close(fd_);
  }

  int fd_ = -1;
  bool connected_ = false;
  bool ended_ = false;
};

}  // namespace kerf::test
