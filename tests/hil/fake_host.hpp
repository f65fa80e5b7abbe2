// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "shared/wire/omni.hpp"

namespace kerf::test {

/// A path for one test's socket, removed at the end.
class SocketPath {
 public:
  explicit SocketPath(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("kerf-hil-" + std::to_string(::getpid()) + "-" + name)) {}
  ~SocketPath() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  [[nodiscard]] std::string text() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// The host's end of the socket, as simple as it can be.
class FakeHost {
 public:
  /// Tries for 5 s.
  explicit FakeHost(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    for (int attempt = 0; attempt < 500 && !connected_; ++attempt) {
      fd_ = socket(AF_UNIX, SOCK_SEQPACKET, 0);
      connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
      if (connected_) break;
      close(fd_);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  FakeHost(const FakeHost&) = delete;
  FakeHost& operator=(const FakeHost&) = delete;
  ~FakeHost() { leave(); }

  void leave() {
    if (connected_) close(fd_);
    connected_ = false;
  }
  [[nodiscard]] bool connected() const { return connected_; }

  void send(const OmniCommand& command) const {
    const auto bytes = encode(command);
    (void)::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

  /// The next packet within `timeout_ms`; nothing on timeout, end, or when it is no report.
  [[nodiscard]] std::optional<OmniReport> receive(int timeout_ms = 5000) {
    pollfd ready{fd_, POLLIN, 0};
    if (poll(&ready, 1, timeout_ms) <= 0) return std::nullopt;
    std::array<std::uint8_t, 64> bytes{};
    const ssize_t size = recv(fd_, bytes.data(), bytes.size(), 0);
    ended_ = size <= 0;
    if (ended_) return std::nullopt;
    return decode_report({bytes.data(), static_cast<std::size_t>(size)});
  }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  int fd_ = -1;
  bool connected_ = false;
  bool ended_ = false;
};

}  // namespace kerf::test
