// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>  // before Boost 1.74's awaitable, which needs it

#include <boost/asio/awaitable.hpp>

#include "bridge/net/address.hpp"
#include "bridge/net/bridge_error.hpp"
#include "bridge/net/link.hpp"
#include "bridge/net/server_trust.hpp"

namespace kerf::bridge {

/// Ends a connection that cannot get better by trying again, unless it once worked.
struct Hopeless : BridgeError {
  using BridgeError::BridgeError;
};

/// Leads `ws`, a fresh socket, from its first packet to a WebSocket that talks. Throws `Hopeless`,
/// or what may be better the next time: `BridgeError` and Boost's system_error.
asio::awaitable<void> dial(WebSocket& ws, const BridgeAddress& address, ServerTrust& trust);

/// What the server said by closing, 4001 and so on, to who showed a token or none: throws as
/// `dial`.
[[noreturn]] void throw_closed(std::uint16_t code, bool had_token);

}  // namespace kerf::bridge
