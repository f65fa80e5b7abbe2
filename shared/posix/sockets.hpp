// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <sys/socket.h>
#include <unistd.h>

// Addresses for UDP, and the user behind a Unix socket.

namespace kerf {

/// A UDP address, as the sockets API takes it.
struct UdpAddress {
  sockaddr_storage storage{};
  socklen_t bytes = 0;
  std::string error;  ///< the problem with the text; empty if there is none

  [[nodiscard]] const sockaddr* get() const noexcept {
    return reinterpret_cast<const sockaddr*>(&storage);
  }
};

/// Parses `[ADDRESS:]PORT`: a number or a name, IPv6 in brackets; without an address this machine
/// (127.0.0.1). Calls the resolver, which may take seconds for a name.
[[nodiscard]] UdpAddress resolve_udp(const std::string& text);

/// Only this user and root may use our Unix sockets. Returns the user of the peer of `fd` if it is
/// another one (-1 if unknown), else nothing.
[[nodiscard]] inline std::optional<uid_t> other_user_at(int fd) noexcept {
  ucred peer{};
  socklen_t length = sizeof peer;
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &length) != 0) return static_cast<uid_t>(-1);
  if (peer.uid == geteuid() || peer.uid == 0) return std::nullopt;
  return peer.uid;
}

}  // namespace kerf
