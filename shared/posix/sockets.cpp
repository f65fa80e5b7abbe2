// SPDX-License-Identifier: Apache-2.0

#include "shared/posix/sockets.hpp"

#include <charconv>
#include <cstdint>
#include <cstring>
#include <memory>

#include <netdb.h>

namespace kerf {
namespace {

constexpr const char* kThisMachine = "127.0.0.1";

struct FreeAddresses {
  void operator()(addrinfo* list) const noexcept { freeaddrinfo(list); }
};

/// The resolver itself takes 99999 and an empty port.
bool is_port(const std::string& text) {
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

}  // namespace

UdpAddress resolve_udp(const std::string& text) {
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

}  // namespace kerf
