// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/link.hpp"

namespace kerf::bridge {

Link::Link(tcp::socket socket, asio::ssl::context* tls) : tcp_(std::move(socket)) {
  if (tls != nullptr) tls_ = std::make_unique<Tls>(tcp_, *tls);
}

void Link::read_some(const Some<asio::mutable_buffer>& into, Done done) {
  if (tls_) {
    tls_->async_read_some(into, std::move(done));
  } else {
    tcp_.async_read_some(into, std::move(done));
  }
}

void Link::write_some(const Some<asio::const_buffer>& from, Done done) {
  if (tls_) {
    tls_->async_write_some(from, std::move(done));
  } else {
    tcp_.async_write_some(from, std::move(done));
  }
}

}  // namespace kerf::bridge
