// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include <netdb.h>
#include <sys/socket.h>
#include <sys/un.h>
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
[[nodiscard]] inline UdpAddress resolve_udp(const std::string& text) {
  constexpr const char* kThisMachine = "127.0.0.1";
  struct FreeAddresses {
    void operator()(addrinfo* list) const noexcept { freeaddrinfo(list); }
  };
  const auto is_port = [](const std::string& word) {  // the resolver takes 99999 and an empty port
    std::uint16_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc{} && end == word.data() + word.size();
  };
  const auto colon = text.rfind(':');
  std::string host = colon == std::string::npos ? kThisMachine : text.substr(0, colon);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {  // IPv6
    host = host.substr(1, host.size() - 2);
  }
  UdpAddress address;
  if (!is_port(port)) {
    address.error = "'" + port + "' is no port from 0 to 65535";
    return address;
  }
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int failed = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found); failed != 0) {
    address.error = failed == EAI_NONAME ? "'" + host + "' is no address and no known name"
                                         : std::string(gai_strerror(failed));
    return address;
  }
  const std::unique_ptr<addrinfo, FreeAddresses> list(found);
  address.bytes = list->ai_addrlen;
  std::memcpy(&address.storage, list->ai_addr, list->ai_addrlen);
  return address;
}

/// The address of the Unix socket at `path`, which is shorter than `sun_path`.
[[nodiscard]] inline sockaddr_un unix_address(std::string_view path) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

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
