// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/link.hpp"

#include <chrono>

namespace kerf::bridge {

void Link::stop_reading() {
  reads_ = false;
  tcp_.cancel();
}

void Link::read_some(const LinkBuffers<asio::mutable_buffer>& into, LinkHandler done) {
  if (!reads_) {
    return asio::post(get_executor(),
                      beast::bind_handler(std::move(done), asio::error::eof, std::size_t{0}));
  }
  tls_ ? tls_->async_read_some(into, std::move(done)) : tcp_.async_read_some(into, std::move(done));
}

void Link::write_some(const LinkBuffers<asio::const_buffer>& from, LinkHandler done) {
  tls_ ? tls_->async_write_some(from, std::move(done))
       : tcp_.async_write_some(from, std::move(done));
}

asio::awaitable<void> linger(beast::tcp_stream& stream) {
  ErrorCode error;
  stream.socket().shutdown(tcp::socket::shutdown_send, error);
  stream.expires_after(std::chrono::seconds(1));
  std::array<char, 4096> unread;
  while (!error) co_await stream.async_read_some(asio::buffer(unread), quiet(error));
}

}  // namespace kerf::bridge
