// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/dial.hpp"

#include <chrono>
#include <string>

#include "bridge/wire/messages.hpp"

namespace kerf::bridge {
namespace {

namespace websocket = beast::websocket;
using asio::use_awaitable;
using namespace std::chrono_literals;

constexpr auto kConnectPatience = 1500ms;  // a lost SYN comes again after 1 s
constexpr auto kGreetingPatience = 10s;    // TLS and HTTP over a slow link

[[noreturn]] void throw_no_trust(const ServerTrust& trust, const ErrorCode& error) {
  if (const std::string reason = trust.refusal(); !reason.empty()) throw Hopeless(reason);
  if (error.category() == asio::error::get_ssl_category()) {
    throw Hopeless("no TLS 1.3 there; is it a kerf-bridge serve, and off loopback?");
  }
  throw boost::system::system_error(error);
}

/// True where something answered that is no HTTP, and not where it broke off.
[[nodiscard]] bool is_no_http(const ErrorCode& error) {
  using Http = beast::http::error;
  return error == Http::bad_version || error == Http::bad_line_ending ||
         error == Http::bad_status || error == Http::bad_reason || error == Http::bad_field ||
         error == Http::bad_value;
}

[[noreturn]] void throw_no_welcome(const ErrorCode& error, unsigned status) {
  if (is_no_http(error)) throw Hopeless("speaks no HTTP; take the port of a kerf-bridge serve");
  if (error != websocket::error::upgrade_declined) throw boost::system::system_error(error);
  if (status == 400) throw Hopeless("takes no unencrypted viewers; take wss://");
  if (status == 404) throw Hopeless("no kerf-bridge serve answers; take its port");
  if (status == 421) {
    throw Hopeless("does not know itself by this name; take the address it prints");
  }
  const std::string answer = "answers " + std::to_string(status) + "; is it a kerf-bridge serve?";
  // Those of a gateway whose server is not up yet, or has too much to do: that may change.
  if (status >= 500 || status == 429) throw BridgeError(answer);
  throw Hopeless(answer);
}

}  // namespace

asio::awaitable<void> dial(WebSocket& ws, const BridgeAddress& address, ServerTrust& trust) {
  Link& link = ws.next_layer();
  beast::tcp_stream& tcp_stream = link.next_layer();
  tcp::resolver resolver(ws.get_executor());
  const auto places = co_await resolver.async_resolve(address.host, address.port, use_awaitable);
  if (!link.is_tls()) {  // whatever a name stands for here
    for (const auto& place : places) {
      if (place.endpoint().address().is_loopback()) continue;
      throw Hopeless("is " + place.endpoint().address().to_string() +
                     ", and unencrypted is for loopback only; take wss://");
    }
  }
  tcp_stream.expires_after(kConnectPatience);
  co_await tcp_stream.async_connect(places, use_awaitable);
  tcp_stream.socket().set_option(tcp::no_delay(true));
  tcp_stream.expires_after(kGreetingPatience);
  ErrorCode error;
  if (link.is_tls()) {
    trust.begin(link.tls().native_handle());
    co_await link.tls().async_handshake(asio::ssl::stream_base::client, quiet(error));
    if (error) throw_no_trust(trust, error);
  }
  ws.read_message_max(kMaxMessageBytes);
  const std::string target =
      kBridgePath + (address.token.empty() ? std::string() : "?token=" + address.token);
  websocket::response_type response;
  co_await ws.async_handshake(response, address.host_and_port(), target, quiet(error));
  if (error) throw_no_welcome(error, response.result_int());
  tcp_stream.expires_never();
  ws.binary(true);
}

void throw_closed(std::uint16_t code, bool had_token) {
  switch (static_cast<CloseCode>(code)) {
    case CloseCode::no_token:
      if (!had_token) {
        throw Hopeless("asks for a token; take all of the wss:// address it prints, in quotes");
      }
      throw Hopeless("the token is not one of its own; take the wss:// address it prints");
    case CloseCode::too_many:
      throw BridgeError("has as many viewers as it takes");
    case CloseCode::too_slow:
      throw BridgeError("had no answer from here for 5 s");
    case CloseCode::not_understood:
      throw BridgeError("does not understand this program; use programs of one build");
  }
  throw BridgeError("closed the connection");
}

}  // namespace kerf::bridge
