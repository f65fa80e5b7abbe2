// SPDX-License-Identifier: Apache-2.0

#include "bridge/net/address.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <unistd.h>

#include "shared/text/text.hpp"

namespace kerf::bridge {
namespace {

constexpr std::size_t kLongest = 253;  // of a name in DNS; a token is shorter

/// Letters, digits and `others` alone.
[[nodiscard]] bool plain(std::string_view text, std::string_view others) noexcept {
  return std::all_of(text.begin(), text.end(), [others](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           others.find(c) != std::string_view::npos;
  });
}

/// Empty for what is neither IPv4 nor an IPv6 address that is reached without naming an interface.
std::string text_of(const sockaddr* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address == nullptr) return {};
  if (address->sa_family == AF_INET) {
    const auto* const v4 = reinterpret_cast<const sockaddr_in*>(address);
    inet_ntop(AF_INET, &v4->sin_addr, text.data(), text.size());
  } else if (address->sa_family == AF_INET6) {
    const auto* const v6 = reinterpret_cast<const sockaddr_in6*>(address);
    if (IN6_IS_ADDR_LINKLOCAL(&v6->sin6_addr)) return {};
    inet_ntop(AF_INET6, &v6->sin6_addr, text.data(), text.size());
  }
  return text.data();
}

/// This machine's name; empty if it has none.
std::string machine_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

/// A name of DNS (RFC 1035), which a certificate can have.
bool is_dns_name(std::string_view name) noexcept {
  if (name.size() > kLongest) return false;
  for (;;) {
    const std::string_view label = name.substr(0, name.find('.'));
    if (label.empty() || label.size() > 63 || !plain(label, "-_")) return false;
    if (label.front() == '-' || label.back() == '-') return false;
    if (label.size() == name.size()) return true;
    name.remove_prefix(label.size() + 1);
  }
}

}  // namespace

bool is_address(const std::string& host) noexcept {
  in6_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

bool is_loopback(std::string_view host) noexcept {
  return host == "localhost" || host == "::1" ||
         (host.starts_with("127.") && host.find_first_not_of("0123456789.") == host.npos);
}

std::vector<std::string> own_addresses() {
  std::vector<std::string> out;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return out;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    std::string text = text_of(one->ifa_addr);
    if (!text.empty()) out.push_back(std::move(text));
  }
  freeifaddrs(all);
  return out;
}

std::vector<std::string> own_hosts() {
  std::vector<std::string> out;
  if (const std::string name = machine_name(); is_dns_name(name + ".local")) {
    out = {name, name + ".local"};
  }
  out.emplace_back("localhost");
  for (std::string& address : own_addresses()) out.push_back(std::move(address));
  return out;
}

namespace {

/// Takes `start` off `text` if it is there.
[[nodiscard]] bool take(std::string_view& text, std::string_view start) noexcept {
  if (!text.starts_with(start)) return false;
  text.remove_prefix(start.size());
  return true;
}

[[nodiscard]] bool is_port(std::string_view text) noexcept {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port != 0;
}

constexpr const char *kHttpsPort = "443", *kHttpPort = "80";

/// Reads the path that a proxy adds: segments of letters, digits and -._~, none of them only dots.
[[nodiscard]] bool is_path(std::string_view path) noexcept {
  while (!path.empty()) {
    if (!take(path, "/")) return false;
    const std::string_view segment = path.substr(0, path.find('/'));
    if (segment.find_first_not_of('.') == segment.npos || !plain(segment, "-._~")) return false;
    path.remove_prefix(segment.size());
  }
  return true;
}

/// `form`: what an address is, and what to do if it is none.
BridgeAddress read_address(std::string_view text, const std::string& option,
                           const std::string& form) {
  const auto refuse = [&](const std::string& way_out) {
    // The token is a secret, and the rest may be long or hold line ends.
    const std::size_t shown = std::min<std::size_t>(text.find('?'), 80);
    return BridgeError(one_line(option + std::string(text.substr(0, shown)) + ": " + way_out));
  };
  BridgeAddress out;
  out.port = "7400";
  std::string_view rest = text;
  if (take(rest, "https://")) {
    out.port = kHttpsPort;
  } else if (take(rest, "http://")) {
    out.secure = false;
    out.port = kHttpPort;
  } else if (take(rest, "ws://")) {
    out.secure = false;
  } else if (!take(rest, "wss://")) {
    throw refuse(form);
  }
  const std::size_t end = std::min(rest.find_first_of("/?"), rest.size());
  std::string_view place = rest.substr(0, end), query = rest.substr(end);
  if (take(place, "[")) {
    const std::size_t close = place.find(']');
    if (close == place.npos) throw refuse(form);
    out.host = place.substr(0, close);
    place.remove_prefix(close + 1);
    if (!plain(out.host, ":.")) throw refuse(form);
  } else {
    out.host = place.substr(0, place.find(':'));
    place.remove_prefix(out.host.size());
    if (!plain(out.host, ".-_")) throw refuse(form);
  }
  if (out.host.empty() || out.host.size() > kLongest) throw refuse(form);
  if (take(place, ":")) {
    if (!is_port(place)) throw refuse("no port from 1 to 65535; take what serve prints");
    out.port = place;
  } else if (!place.empty()) {
    throw refuse(form);
  }
  out.path = query.substr(0, query.find('?'));
  query.remove_prefix(out.path.size());
  while (out.path.ends_with('/')) out.path.pop_back();
  if (out.path.size() > kLongest || !is_path(out.path)) throw refuse(form);
  if (take(query, "?token=")) {
    if (query.empty() || query.size() > kLongest || !plain(query, "-_.~")) {
      throw refuse("no such token; take the one that serve prints");
    }
    out.token = query;
  } else if (!query.empty()) {
    throw refuse(form);
  }
  if (!out.secure && !is_loopback(out.host)) {
    throw refuse("unencrypted is for loopback only; take " +
                 std::string(text.starts_with("http") ? "https://" : "wss://"));
  }
  return out;
}

}  // namespace

std::string BridgeAddress::host_and_port() const {
  return (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + port;
}

std::string BridgeAddress::origin() const {
  std::string text = (secure ? "https://" : "http://") + host_and_port();
  if (port == (secure ? kHttpsPort : kHttpPort)) text.resize(text.size() - port.size() - 1);
  return text;
}

BridgeAddress parse_address(std::string_view text) {
  return read_address(text, "join: ", "not wss://HOST:PORT/?token=TOKEN; take what serve prints");
}

BridgeAddress parse_public_url(std::string_view text) {
  const std::string form =
      "not https://HOST[:PORT][/PATH]; give the address at which browsers reach the proxy";
  if (!text.starts_with("http") || text.find('?') != text.npos) {
    throw BridgeError(one_line(
        "--public-url " + std::string(text.substr(0, std::min<std::size_t>(text.find('?'), 80))) +
        ": " + form));
  }
  return read_address(text, "--public-url ", form);
}

}  // namespace kerf::bridge
