// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace kerf::bridge {

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
