// SPDX-License-Identifier: Apache-2.0
// Connections that are not viewers yet: TLS handshake, HTTP requests, and the page's files.
#include <algorithm>
#include <chrono>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/write.hpp>

#include "bridge/page/page_files.hpp"
#include "bridge/serve/server_impl.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/text.hpp"

namespace kerf::bridge {

namespace {

namespace http = beast::http;

constexpr auto kReplyTime = std::chrono::seconds(30);  // enough for 200 KB at 64 kbit/s
constexpr std::uint32_t kMaxHeaderBytes = 8 * 1024;

/// Reply to one HTTP request.
struct HttpReply {
  int status = 200;
  std::string_view content_type = "text/plain; charset=utf-8";
  std::string_view body;
  std::string cookie;  ///< value of Set-Cookie; empty: none
  bool keep_alive = true;
  bool head_only = false;  ///< the request was a HEAD
  std::string location{};  ///< target of a redirect; empty: none
};

std::string_view reason(int status) noexcept {
  switch (status) {
    case 200:
      return "OK";
    case 308:
      return "Permanent Redirect";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 421:
      return "Misdirected Request";
    default:
      return "Error";
  }
}

constexpr std::string_view kHeaders =
    "Cache-Control: no-store\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; worker-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Permissions-Policy: camera=(), microphone=(), geolocation=(), usb=(), serial=(), hid=()\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n";

/// The text of a reply. Its headers forbid what the page does not need: inline scripts and styles,
/// content and connections of other hosts, framing by other pages, guessing of content types.
std::string http_text(const HttpReply& reply) {
  std::string text = "HTTP/1.1 " + std::to_string(reply.status) + " ";
  text += reason(reply.status);
  text += "\r\nContent-Type: ";
  text += reply.content_type;
  text += "\r\nContent-Length: " + std::to_string(reply.body.size()) + "\r\n";
  text += kHeaders;
  if (reply.status == 405) text += "Allow: GET, HEAD\r\n";
  if (!reply.cookie.empty()) text += "Set-Cookie: " + reply.cookie + "\r\n";
  if (!reply.location.empty()) text += "Location: " + reply.location + "\r\n";
  text += reply.keep_alive ? "\r\n" : "Connection: close\r\n\r\n";
  if (!reply.head_only) text += reply.body;
  return text;
}

std::string_view text(beast::string_view view) {
  return {view.data(), view.size()};
}

/// The first Foxglove subprotocol of the request that kerf knows; empty if there is none.
std::string_view foxglove_protocol_of(const Request& request) {
  const auto [begin, end] = request.equal_range(http::field::sec_websocket_protocol);
  for (auto header = begin; header != end; ++header) {
    const std::string_view protocol = foxglove_protocol(text(header->value()));
    if (!protocol.empty()) return protocol;
  }
  return {};
}

}  // namespace

asio::awaitable<void> Server::Impl::connection(tcp::socket socket) {
  auto ws = std::make_unique<WebSocket>(std::move(socket), tls_ ? &*tls_ : nullptr);
  beast::flat_buffer in(kMaxHeaderBytes);
  bool done = true;
  if (tls_) co_await handshake(*ws, in, done);
  if (done) co_await talk_http(std::move(ws), in);
}

asio::awaitable<void> Server::Impl::handshake(WebSocket& ws, beast::flat_buffer& in, bool& done) {
  Link& link = ws.next_layer();
  const HandshakeSlot slot(*this, link.next_layer());
  ErrorCode error;
  done = false;
  link.next_layer().expires_after(std::chrono::nanoseconds(setup_.handshake_ns));
  in.commit(co_await link.next_layer().async_read_some(in.prepare(kMaxHeaderBytes), quiet(error)));
  if (error) co_return;
  constexpr char kTlsHandshake = 22;  // first byte of a TLS client's first message
  done = *static_cast<const char*>(in.data().data()) == kTlsHandshake;
  if (!done) {
    const std::string reply = http_text({400, "text/plain; charset=utf-8",
                                         "This port speaks TLS only: open it with https:// (a "
                                         "page) or wss:// (kerf bridge join).\n",
                                         "", false});
    link.next_layer().socket().send(asio::buffer(reply), 0, error);  // fits the empty send buffer
    co_return;
  }
  const std::size_t used =
      co_await link.tls().async_handshake(asio::ssl::stream_base::server, in.data(), quiet(error));
  in.consume(used);
  done = !error;
  if (done) co_return;
  // A client without the required certificate has already sent its request. Reads it, because a
  // socket closed with unread bytes is reset, and the client might lose the alert.
  in.clear();
  link.next_layer().socket().shutdown(tcp::socket::shutdown_send, error);
  co_await link.next_layer().async_read_some(in.prepare(kMaxHeaderBytes), quiet(error));
}

/// Checks for a viewer's token, then for the cookie, then for the one-time token, so that a browser
/// with a cookie does not use up the one-time token.
Server::Impl::Credentials Server::Impl::credentials_of(const Request& request) const {
  const Tokens& tokens = setup_.tokens;
  const std::string_view asked = query_value(text(request.target()), "token");
  if (const Right right = tokens.right_of(asked); right != Right::none) {
    return {right, true, false, cookie_for(asked)};
  }
  if (is_foxglove(request)) return {Right::none, !asked.empty(), false, {}};
  const std::string_view kept = cookie_value(text(request[http::field::cookie]), cookie_name());
  if (const Right right = tokens.right_of_cookie(kept); right != Right::none) {
    return {right, true, false, {}};
  }
  if (!beast::websocket::is_upgrade(request) && page_token_.is(asked)) {
    return {tokens.right_of(tokens.first()), true, true, cookie_for(tokens.first())};
  }
  return {Right::none, !asked.empty() || !kept.empty(), false, {}};
}

/// The path of a request, without the proxy's prefix, which the proxy may have removed or not.
/// Empty if the path is the prefix without the final slash, which the page's relative addresses
/// need.
std::string_view Server::Impl::route_of(const Request& request) const {
  std::string_view route = path_of(text(request.target()));
  const std::string_view path =
      setup_.public_url ? std::string_view(setup_.public_url->path) : std::string_view();
  if (!route.starts_with(path)) return route;
  const std::string_view rest = route.substr(path.size());
  return rest.empty() || rest.starts_with('/') ? rest : route;
}

/// True if the request opens a WebSocket of Foxglove's protocol. Its client is a page of another
/// origin, or a program without cookies, so only the token in the address counts, and the origin is
/// not checked.
bool Server::Impl::is_foxglove(const Request& request) const {
  return beast::websocket::is_upgrade(request) && route_of(request) == kFoxglovePath;
}

/// True if the request was sent to the address of `--public-url`, by its `Host`.
bool Server::Impl::is_public(const Request& request) const {
  return setup_.public_url &&
         is_own_origin(setup_.public_url->origin(), text(request[http::field::host]),
                       setup_.public_url->secure);
}

std::string Server::Impl::page_text(const Request& request, const Credentials& shown) {
  HttpReply reply;
  reply.keep_alive = request.keep_alive();
  reply.head_only = request.method() == http::verb::head;
  if (route_of(request).empty()) {
    const std::string_view target = text(request.target());
    const std::size_t path = path_of(target).size();
    reply.status = 308;
    reply.location = std::string(target.substr(0, path)) + "/" + std::string(target.substr(path));
    return http_text(reply);
  }
  if (shown.right == Right::none) {
    reply.status = 401;
    reply.body = shown.secret
                     ? "This address was opened before, or is of another start: open the one that "
                       "kerf bridge printed last. Each is for one browser.\n"
                     : "This picture needs a token: open the address that kerf bridge printed, "
                       "with all of its ?token=...\n";
    return http_text(reply);
  }
  if (!shown.cookie.empty() && !reply.head_only) {
    // Without `Path` the cookie applies to the folder that the browser sees, behind any proxy.
    const bool secure = tls_ || (is_public(request) && setup_.public_url->secure);
    reply.cookie = cookie_name() + "=" + shown.cookie + "; HttpOnly; SameSite=Strict" +
                   (secure ? "; Secure" : "");
    if (shown.one_time) {
      page_token_.renew();
      if (setup_.on_page_token) setup_.on_page_token(page_token_.token());
    }
  }
  std::string_view name = route_of(request).substr(1);
  if (name.empty()) name = "index.html";
  const auto files = page_files();
  const auto file = std::find_if(files.begin(), files.end(),
                                 [name](const PageFile& one) { return one.name == name; });
  if (file == files.end()) {
    reply.status = 404;
    reply.body =
        "No such page. If a proxy adds a path to the address: kerf bridge serve --public-url.\n";
  } else {
    reply.content_type = file->content_type;
    reply.body = file->bytes;
  }
  return http_text(reply);
}

void Server::Impl::say_at_most_once_a_second(const std::string& text) {
  const std::int64_t now_ns = monotonic_ns();
  if (now_ns - warned_ns_ < kNsPerSecond) return;
  warned_ns_ = now_ns;
  std::cerr << "kerf-bridge: " << escaped(text) << '\n';
}

/// The refusal of a request that no token would help: it is unclear, for another host, neither GET
/// nor HEAD, or a WebSocket of another origin's page.
std::optional<Server::Impl::Refusal> Server::Impl::refusal_of(const Request& request) const {
  const std::string_view host = text(request[http::field::host]);
  if (request.count(http::field::host) > 1 || request.count(http::field::origin) > 1) {
    return Refusal{400, "This names its host or its origin twice.\n"};
  }
  if (!is_own_host(host_name(host), setup_.host_names)) {
    return Refusal{421,
                   "Open this machine by its address or its own name; if a proxy has another: kerf "
                   "bridge serve --public-url.\n"};
  }
  const bool is_read = request.method() == http::verb::get || request.method() == http::verb::head;
  if (!is_read || !request.target().starts_with('/')) {
    return Refusal{405, "Only GET and HEAD are answered here.\n"};
  }
  const std::string proxy = setup_.public_url ? setup_.public_url->origin() : std::string();
  if (beast::websocket::is_upgrade(request) && !is_foxglove(request) &&
      !is_own_origin(text(request[http::field::origin]), host, tls_.has_value(), proxy)) {
    return Refusal{403,
                   "A page from elsewhere may not look in here; if it came through a proxy: kerf "
                   "bridge serve --public-url.\n"};
  }
  return std::nullopt;
}

asio::awaitable<void> Server::Impl::refuse(Link& link, int status, std::string_view why,
                                           bool head_only) {
  ErrorCode error;
  const std::string reply =
      http_text({status, "text/plain; charset=utf-8", why, "", false, head_only});
  link.next_layer().expires_after(kReplyTime);
  co_await asio::async_write(link, asio::buffer(reply), quiet(error));
  if (!error) co_await linger(link.next_layer());
}

asio::awaitable<void> Server::Impl::talk_http(std::unique_ptr<WebSocket> ws,
                                              beast::flat_buffer& in) {
  Link& link = ws->next_layer();
  HandshakeSlot slot(*this, link.next_layer());
  ErrorCode error;
  for (bool more = true; more && !error;) {
    http::request_parser<http::empty_body> parser;
    parser.header_limit(kMaxHeaderBytes);
    parser.body_limit(0);
    link.next_layer().expires_after(std::chrono::nanoseconds(setup_.handshake_ns));
    co_await http::async_read(link, in, parser, quiet(error));
    if (error == http::error::end_of_stream || error == beast::error::timeout) co_return;
    if (error) co_return co_await refuse(link, 400, "This is no request for a page.\n", false);
    const Request& request = parser.get();
    const bool head = request.method() == http::verb::head;
    if (const std::optional<Refusal> refusal = refusal_of(request)) {
      co_return co_await refuse(link, refusal->status, refusal->why, head);
    }
    const Credentials shown = credentials_of(request);
    if (shown.right == Right::none && shown.secret) {
      // The connection keeps its slot, so one host can try at most 32 tokens per second.
      slot.is_guess = true;
      say_at_most_once_a_second("a wrong token from " + slot.from().to_string());
      asio::steady_timer wait(io_, std::chrono::nanoseconds(setup_.wrong_token_ns));
      co_await wait.async_wait(quiet(error));
      slot.is_guess = false;
    }
    if (beast::websocket::is_upgrade(request) && route_of(request) == kBridgePath) {
      const Request upgrade_request = parser.release();
      co_return co_await view(std::move(ws), upgrade_request, shown.right, {}, slot);
    }
    if (is_foxglove(request)) {
      if (shown.right == Right::none) {
        co_return co_await refuse(link, 401,
                                  "Foxglove needs a token: the wss:// address that kerf bridge "
                                  "printed, with foxglove before its ?token=...\n",
                                  head);
      }
      const std::string_view protocol = foxglove_protocol_of(request);
      if (protocol.empty()) {
        co_return co_await refuse(link, 400,
                                  "Sec-WebSocket-Protocol has to offer foxglove.sdk.v1 or "
                                  "foxglove.websocket.v1.\n",
                                  head);
      }
      const Request upgrade_request = parser.release();
      co_return co_await view(std::move(ws), upgrade_request, shown.right, protocol, slot);
    }
    const std::string reply = page_text(request, shown);
    more = request.keep_alive();
    link.next_layer().expires_after(kReplyTime);
    co_await asio::async_write(link, asio::buffer(reply), quiet(error));
  }
  link.next_layer().socket().shutdown(tcp::socket::shutdown_send, error);
}

}  // namespace kerf::bridge
