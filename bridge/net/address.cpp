// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/address.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>

#include "bridge/net/bridge_error.hpp"
#include "bridge/net/host_names.hpp"
#include "shared/text/words.hpp"

namespace kerf::bridge {
namespace {

constexpr std::size_t kLongest = 253;  // of a name in DNS; a token is shorter

[[nodiscard]] bool plain(std::string_view text, std::string_view others) noexcept {
  return std::all_of(text.begin(), text.end(), [others](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           others.find(c) != std::string_view::npos;
  });
}

/// Takes `start` off `text` where it is there.
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

}  // namespace

std::string BridgeAddress::host_and_port() const {
  return (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + port;
}

BridgeAddress parse_address(std::string_view text) {
  const auto refuse = [text](const std::string& way_out) {
    // The token is a secret, and the rest may be long or hold line ends.
    const std::size_t shown = std::min<std::size_t>(text.find('?'), 80);
    return BridgeError(one_line("join: " + std::string(text.substr(0, shown)) + ": " + way_out));
  };
  constexpr const char* kForm = "not wss://HOST:PORT/?token=TOKEN; take what serve prints";
  BridgeAddress out;
  std::string_view rest = text;
  if (take(rest, "ws://") || take(rest, "http://")) {
    out.secure = false;
  } else if (!take(rest, "wss://") && !take(rest, "https://")) {
    throw refuse(kForm);
  }
  const std::size_t end = std::min(rest.find_first_of("/?"), rest.size());
  std::string_view place = rest.substr(0, end), query = rest.substr(end);
  if (take(place, "[")) {
    const std::size_t close = place.find(']');
    if (close == place.npos) throw refuse(kForm);
    out.host = place.substr(0, close);
    place.remove_prefix(close + 1);
    if (!plain(out.host, ":.")) throw refuse(kForm);
  } else {
    out.host = place.substr(0, place.find(':'));
    place.remove_prefix(out.host.size());
    if (!plain(out.host, ".-_")) throw refuse(kForm);
  }
  if (out.host.empty() || out.host.size() > kLongest) throw refuse(kForm);
  if (take(place, ":")) {
    if (!is_port(place)) throw refuse("no port from 1 to 65535; take what serve prints");
    out.port = place;
  } else if (!place.empty()) {
    throw refuse(kForm);
  }
  static_cast<void>(take(query, "/"));
  if (take(query, "?token=")) {
    if (query.empty() || query.size() > kLongest || !plain(query, "-_.~")) {
      throw refuse("no such token; take the one that serve prints");
    }
    out.token = query;
  } else if (!query.empty()) {
    throw refuse(kForm);
  }
  if (!out.secure && !is_loopback(out.host)) {
    throw refuse("unencrypted is for loopback only; take wss://");
  }
  return out;
}

}  // namespace kerf::bridge
