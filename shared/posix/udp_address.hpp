// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <sys/socket.h>

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

}  // namespace kerf
