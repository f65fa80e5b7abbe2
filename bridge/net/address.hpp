// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace kerf::bridge {

/// Ends the program at start: one line "location: value; way out".
struct BridgeError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Whether `host` is an address, IPv4 or IPv6 without brackets, not a name.
[[nodiscard]] bool is_address(const std::string& host) noexcept;

/// Whether `host` is this machine's loopback, by its text alone.
[[nodiscard]] bool is_loopback(std::string_view host) noexcept;

/// This machine's addresses, with those of loopback: IPv4 and global IPv6, as text.
[[nodiscard]] std::vector<std::string> own_addresses();

/// Names and addresses by which a browser may call this machine: its name, name.local, localhost,
/// and its addresses. A name that DNS does not allow is left out.
[[nodiscard]] std::vector<std::string> own_hosts();

/// The address of a bridge, as `kerf-bridge serve` prints it.
struct BridgeAddress {
  bool secure = true;  ///< wss or https, not ws or http
  std::string host;    ///< a name, or an address; IPv6 without brackets
  std::string port;
  std::string path;   ///< that a proxy adds, as /lab/kerf; empty: none
  std::string token;  ///< empty: none

  /// HOST:PORT, for messages and for the request.
  [[nodiscard]] std::string host_and_port() const;
  /// http(s)://HOST[:PORT] as a browser writes it in the header Origin: without the usual port.
  [[nodiscard]] std::string origin() const;
};

/// Reads `wss://HOST[:PORT][PATH][?token=TOKEN]`. https:// and http:// are read as wss:// and
/// ws://, because users copy them from a browser. Default port: 7400; 443 for https and 80 for
/// http. Throws `BridgeError`, also if ws:// or http:// names another machine.
[[nodiscard]] BridgeAddress parse_address(std::string_view text);

/// Reads `https://HOST[:PORT][PATH]` of serve's `--public-url`. Throws `BridgeError`.
[[nodiscard]] BridgeAddress parse_public_url(std::string_view text);

}  // namespace kerf::bridge
