// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>

namespace kerf::bridge {

namespace asio = boost::asio;
namespace beast = boost::beast;
using tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

/// A TCP connection, plain or under TLS: chosen at run time, so that what is built on it is
/// compiled once. An AsyncStream of Beast; its timeouts are those of `next_layer`.
class Link {
 public:
  using next_layer_type = beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  /// `tls` outlives the link; nullptr: plain.
  Link(tcp::socket socket, asio::ssl::context* tls) : tcp_(std::move(socket)) {
    if (tls != nullptr) tls_ = std::make_unique<Tls>(tcp_, *tls);
  }

  executor_type get_executor() noexcept { return tcp_.get_executor(); }
  next_layer_type& next_layer() noexcept { return tcp_; }
  const next_layer_type& next_layer() const noexcept { return tcp_; }
  [[nodiscard]] bool is_tls() const noexcept { return tls_ != nullptr; }
  /// For handshakes; only where `is_tls`.
  beast::ssl_stream<beast::tcp_stream&>& tls() noexcept { return *tls_; }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return asio::async_initiate<Handler, void(ErrorCode, std::size_t)>(
        [this](auto&& done, const Buffers& into) {
          if (tls_) {
            tls_->async_read_some(into, std::forward<decltype(done)>(done));
          } else {
            tcp_.async_read_some(into, std::forward<decltype(done)>(done));
          }
        },
        handler, buffers);
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    return asio::async_initiate<Handler, void(ErrorCode, std::size_t)>(
        [this](auto&& done, const Buffers& from) {
          if (tls_) {
            tls_->async_write_some(from, std::forward<decltype(done)>(done));
          } else {
            tcp_.async_write_some(from, std::forward<decltype(done)>(done));
          }
        },
        handler, buffers);
  }

 private:
  using Tls = beast::ssl_stream<beast::tcp_stream&>;

  beast::tcp_stream tcp_;
  std::unique_ptr<Tls> tls_;
};

// Where a WebSocket has said goodbye the connection is simply closed: its frames tell where the
// talk ends, so TLS's own goodbye would add nothing but a wait.
inline void teardown(beast::role_type, Link& link, ErrorCode& error) {
  link.next_layer().socket().close(error);
}
template <class Handler>
void async_teardown(beast::role_type, Link& link, Handler&& handler) {
  ErrorCode error;
  link.next_layer().socket().shutdown(tcp::socket::shutdown_both, error);
  asio::post(link.get_executor(), beast::bind_handler(std::forward<Handler>(handler), ErrorCode{}));
}

/// Awaits an operation; its failure goes to `error` instead of an exception.
inline auto quiet(ErrorCode& error) {
  return asio::redirect_error(asio::use_awaitable, error);
}

using WebSocket = beast::websocket::stream<Link>;

}  // namespace kerf::bridge
