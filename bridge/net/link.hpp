// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>

#include "bridge/net/certificate.hpp"

namespace kerf::bridge {

namespace asio = boost::asio;
namespace beast = boost::beast;
using tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

/// The handler of one read or write, with its type erased: TCP and TLS are compiled for this type
/// alone, not for each operation of Beast on a link. That saves two thirds of the compile time.
class LinkHandler {
 public:
  using executor_type = asio::any_io_executor;

  template <class Handler>
  LinkHandler(Handler handler, const executor_type& otherwise)
      : executor_(asio::get_associated_executor(handler, otherwise)),
        held_(std::make_unique<Held<Handler>>(std::move(handler))) {}

  [[nodiscard]] executor_type get_executor() const noexcept { return executor_; }
  void operator()(ErrorCode error, std::size_t bytes) {
    const std::unique_ptr<Any> held = std::move(held_);
    held->end(error, bytes);
  }

 private:
  struct Any {
    virtual ~Any() = default;
    virtual void end(ErrorCode error, std::size_t bytes) = 0;
  };
  template <class Handler>
  struct Held final : Any {
    explicit Held(Handler&& its) : handler(std::move(its)) {}
    void end(ErrorCode error, std::size_t bytes) override { handler(error, bytes); }
    Handler handler;
  };

  executor_type executor_;
  std::unique_ptr<Any> held_;
};

/// The first buffers of a sequence, at most eight: a read or write may be shorter than requested.
template <class Buffer>
class LinkBuffers {
 public:
  template <class Sequence>
  explicit LinkBuffers(const Sequence& sequence) {
    for (auto it = asio::buffer_sequence_begin(sequence);
         it != asio::buffer_sequence_end(sequence) && count_ < buffers_.size(); ++it) {
      buffers_[count_++] = *it;
    }
  }
  using value_type = Buffer;
  [[nodiscard]] const Buffer* begin() const noexcept { return buffers_.data(); }
  [[nodiscard]] const Buffer* end() const noexcept { return buffers_.data() + count_; }

 private:
  std::array<Buffer, 8> buffers_;
  std::size_t count_ = 0;
};

/// A TCP connection, plain or with TLS. The choice is made at run time, so that Beast is compiled
/// for one type. An AsyncStream of Beast; its timeouts are those of `next_layer`.
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
  /// For handshakes; only if `is_tls`.
  beast::ssl_stream<beast::tcp_stream&>& tls() noexcept { return *tls_; }
  /// From now on every read ends as if the peer had closed, also one that waits. Writes go on.
  void stop_reading();

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return asio::async_initiate<Handler, void(ErrorCode, std::size_t)>(
        [this](auto&& done, const Buffers& into) {
          read_some(LinkBuffers<asio::mutable_buffer>(into),
                    LinkHandler(std::forward<decltype(done)>(done), get_executor()));
        },
        handler, buffers);
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    return asio::async_initiate<Handler, void(ErrorCode, std::size_t)>(
        [this](auto&& done, const Buffers& from) {
          write_some(LinkBuffers<asio::const_buffer>(from),
                     LinkHandler(std::forward<decltype(done)>(done), get_executor()));
        },
        handler, buffers);
  }

 private:
  using Tls = beast::ssl_stream<beast::tcp_stream&>;

  void read_some(const LinkBuffers<asio::mutable_buffer>& into, LinkHandler done);
  void write_some(const LinkBuffers<asio::const_buffer>& from, LinkHandler done);

  beast::tcp_stream tcp_;
  std::unique_ptr<Tls> tls_;
  bool reads_ = true;
};

/// Reads and discards until the peer closes, or for a second. A socket that is closed with unread
/// bytes is reset, and the peer may lose what was sent last. Only without another reader.
asio::awaitable<void> linger(beast::tcp_stream& stream);

// After the closing frame of a WebSocket the connection is closed at once, without TLS's own close
// message: that frame marks the end already.
inline void teardown(beast::role_type, Link& link, ErrorCode& error) {
  link.next_layer().socket().close(error);
}
template <class Handler>
void async_teardown(beast::role_type, Link& link, Handler&& handler) {
  ErrorCode error;
  link.next_layer().socket().shutdown(tcp::socket::shutdown_both, error);
  asio::post(link.get_executor(), beast::bind_handler(std::forward<Handler>(handler), ErrorCode{}));
}

/// Boost's view of `tls`, which both own.
inline asio::ssl::context context_of(const Tls& tls) {
  SSL_CTX_up_ref(tls.get());
  return asio::ssl::context(tls.get());
}

/// Completion token: awaits an operation, and stores its failure in `error` without an exception.
inline auto quiet(ErrorCode& error) {
  return asio::redirect_error(asio::use_awaitable, error);
}

using WebSocket = beast::websocket::stream<Link, false>;  // false: no compression of its own

}  // namespace kerf::bridge
