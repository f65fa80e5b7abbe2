// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace kerf::bridge {

/// What ends the program at start: one line "place: value; way out".
struct BridgeError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Whether `host` is an address, IPv4 or IPv6 without brackets, not a name.
[[nodiscard]] bool is_address(const std::string& host) noexcept;

/// Whether what is sent to `host` never leaves this machine, by its text alone.
[[nodiscard]] bool is_loopback(std::string_view host) noexcept;

/// Its addresses that others may reach and loopback's: IPv4 and global IPv6, as text.
[[nodiscard]] std::vector<std::string> own_addresses();

/// Name, name.local, localhost and addresses: by what a browser may call it. A machine's name that
/// is none is left out.
[[nodiscard]] std::vector<std::string> own_hosts();

/// Where a bridge serves, as `kerf-bridge serve` prints it.
struct BridgeAddress {
  bool secure = true;  ///< wss, not ws
  std::string host;    ///< a name, or an address; IPv6 without brackets
  std::string port = "7400";
  std::string token;  ///< empty: none

  /// HOST:PORT, for messages and for the request.
  [[nodiscard]] std::string host_and_port() const;
};

/// Takes `wss://HOST[:PORT][/][?token=TOKEN]`, and https:// and http:// for wss:// and ws://, since
/// that is what a browser shows. Throws `BridgeError`; of ws:// only loopback is taken.
[[nodiscard]] BridgeAddress parse_address(std::string_view text);

}  // namespace kerf::bridge
