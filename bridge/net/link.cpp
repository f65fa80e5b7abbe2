// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/link.hpp"

namespace kerf::bridge {

void Link::read_some(const LinkBuffers<asio::mutable_buffer>& into, LinkHandler done) {
  tls_ ? tls_->async_read_some(into, std::move(done)) : tcp_.async_read_some(into, std::move(done));
}

void Link::write_some(const LinkBuffers<asio::const_buffer>& from, LinkHandler done) {
  tls_ ? tls_->async_write_some(from, std::move(done))
       : tcp_.async_write_some(from, std::move(done));
}

}  // namespace kerf::bridge
