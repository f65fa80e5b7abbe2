// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <sys/socket.h>
#include <unistd.h>

namespace kerf {

/// Where something listens on UDP, as the sockets API wants it.
struct UdpAddress {
  sockaddr_storage storage{};
  socklen_t bytes = 0;
  std::string error;  ///< what is wrong with the text; empty: nothing is

  [[nodiscard]] const sockaddr* get() const noexcept {
    return reinterpret_cast<const sockaddr*>(&storage);
  }
};

/// Of `[ADDRESS:]PORT`: a number or a name, IPv6 in brackets; this machine (127.0.0.1) where none
/// is given. Asks the resolver, which for a name may take seconds.
[[nodiscard]] UdpAddress resolve_udp(const std::string& text);

/// Who may use a Unix socket of ours: this user and root. Gives the user at the other end of `fd`
/// where that is another one (or unknown: nobody, -1).
[[nodiscard]] inline std::optional<uid_t> stranger_at(int fd) noexcept {
  ucred peer{};
  socklen_t length = sizeof peer;
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &length) != 0) return static_cast<uid_t>(-1);
  if (peer.uid == geteuid() || peer.uid == 0) return std::nullopt;
  return peer.uid;
}

}  // namespace kerf
