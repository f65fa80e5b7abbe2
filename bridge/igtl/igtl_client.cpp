// SPDX-License-Identifier: Apache-2.0
#include "bridge/igtl/igtl_client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

namespace kerf::bridge {
namespace {

/// Of one call, so that a large image holds up no other client for long.
constexpr std::size_t kBytesAtOnce = std::size_t{1} << 20;
constexpr int kReadsAtOnce = 16;

bool must_wait(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

}  // namespace

IgtlClient::~IgtlClient() {
  close(socket_);
}

bool IgtlClient::waits(Kind kind) const noexcept {
  return std::any_of(queue_.begin(), queue_.end(),
                     [&](const Waiting& waiting) { return waiting.kind == kind; });
}

void IgtlClient::add(IgtlBytes message, Kind kind) {
  if (queue_.empty()) last_progress_ = Clock::now();
  queue_.push_back({std::move(message), kind});
}

bool IgtlClient::serve(std::chrono::milliseconds patience) {
  if (!throw_away() || !send_some()) return false;
  return queue_.empty() || Clock::now() - last_progress_ <= patience;
}

bool IgtlClient::throw_away() const {
  std::array<char, 4096> unread;
  for (int reads = 0; reads < kReadsAtOnce; ++reads) {
    const ssize_t got = recv(socket_, unread.data(), unread.size(), MSG_DONTWAIT);
    if (got == 0) return false;
    if (got < 0) return must_wait(errno);
  }
  return true;
}

bool IgtlClient::send_some() {
  for (std::size_t left = kBytesAtOnce; left > 0 && !queue_.empty();) {
    const std::vector<std::byte>& message = *queue_.front().message;
    const std::size_t piece = std::min(left, message.size() - sent_);
    const ssize_t took = send(socket_, message.data() + sent_, piece, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (took < 0) return must_wait(errno);
    last_progress_ = Clock::now();
    sent_ += static_cast<std::size_t>(took);
    left -= static_cast<std::size_t>(took);
    if (sent_ < message.size()) continue;
    queue_.pop_front();
    sent_ = 0;
  }
  return true;
}

}  // namespace kerf::bridge
