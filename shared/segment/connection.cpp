// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "shared/posix/failure.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/hand_over_wire.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {
namespace {

constexpr timeval kAnswerTimeout{2, 0};  // the server's thread is never busy for long

/// Receives HELLO and the one descriptor beside it.
[[nodiscard]] OwnedFd receive_segment(int socket, const std::string& path) {
  Hello hello;
  iovec part{&hello, sizeof hello};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  const ssize_t length = recvmsg(socket, &header, MSG_CMSG_CLOEXEC);
  OwnedFd segment;
  const cmsghdr* const rights = CMSG_FIRSTHDR(&header);
  if (length > 0 && rights != nullptr && rights->cmsg_level == SOL_SOCKET &&
      rights->cmsg_type == SCM_RIGHTS && rights->cmsg_len == CMSG_LEN(sizeof(int))) {
    int fd = -1;
    std::memcpy(&fd, CMSG_DATA(rights), sizeof fd);
    segment = OwnedFd(fd);
  }
  if (length == 0) {
    throw SegmentError(path + ": the controller refused; close another reader (at most " +
                       std::to_string(SegmentServer::kMaxPeers) + ")");
  }
  if (length != static_cast<ssize_t>(sizeof hello) || hello.magic != kSegmentMagic ||
      segment.get() < 0) {
    throw SegmentError(path + ": no greeting of a kerf-controller; is it of this version?");
  }
  require_same_layout(hello.layout_major, hello.layout_minor, hello.abi_hash);
  return segment;
}

}  // namespace

SegmentConnection::SegmentConnection(int socket, SegmentReader reader) noexcept
    : socket_(socket), reader_(std::move(reader)) {}

SegmentConnection::SegmentConnection(SegmentConnection&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), reader_(std::move(other.reader_)) {}

SegmentConnection& SegmentConnection::operator=(SegmentConnection&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(reader_, other.reader_);
  return *this;
}

SegmentConnection::~SegmentConnection() {
  if (socket_ >= 0) close(socket_);
}

bool SegmentConnection::alive() const noexcept {
  pollfd polled{socket_, POLLIN, 0};
  if (poll(&polled, 1, 0) < 0) return errno == EINTR;
  if ((polled.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return false;
  return true;
}

Reply SegmentConnection::send(const Command& command) {
  Reply reply;
  if (::send(socket_, &command, sizeof command, MSG_NOSIGNAL) !=
          static_cast<ssize_t>(sizeof command) ||
      recv(socket_, &reply, sizeof reply, 0) != static_cast<ssize_t>(sizeof reply)) {
    throw SegmentError(std::string("command: no answer of the controller: ") +
                       system_message(errno) + "; is it still running?");
  }
  return reply;
}

SegmentConnection connect_segment(std::string_view name) {
  const std::string path = segment_socket(name);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  OwnedFd link(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (link.get() < 0) {
    throw SegmentError("--name " + std::string(name) + ": " + system_message(errno) + "; " +
                       way_out_of(errno, "end other programs"));
  }
  if (connect(link.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw SegmentAbsent("--name " + std::string(name) + ": " + system_message(errno) + " (" + path +
                        "); start kerf-controller with this name first");
  }
  setsockopt(link.get(), SOL_SOCKET, SO_RCVTIMEO, &kAnswerTimeout, sizeof kAnswerTimeout);
  setsockopt(link.get(), SOL_SOCKET, SO_SNDTIMEO, &kAnswerTimeout, sizeof kAnswerTimeout);
  SegmentReader reader = SegmentReader::map(receive_segment(link.get(), path).get());
  return {link.release(), std::move(reader)};
}

}  // namespace kerf
