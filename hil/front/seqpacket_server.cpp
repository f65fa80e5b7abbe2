// SPDX-License-Identifier: Apache-2.0
#include "hil/front/seqpacket_server.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <utility>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/peer.hpp"

namespace kerf {
namespace {

constexpr const char* kUnborn = ".new";  // name until the socket listens

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

template <class Call>
int with_address(const sockaddr_un& address, Call&& call) {
  // The sockets API takes every address as a sockaddr.
  return call(reinterpret_cast<const sockaddr*>(&address), socklen_t{sizeof address});
}

/// Whether somebody listens at `path`. Asks with another socket type, so the answer is a refusal
/// either way and the listener notices nothing.
bool is_live(const std::string& path) {
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;  // not proven stale: leave it alone
  const int result = with_address(
      address_of(path), [fd](const sockaddr* a, socklen_t size) { return connect(fd, a, size); });
  const bool refused = result != 0 && errno == ECONNREFUSED;
  close(fd);
  return !refused;
}

bool is_socket(const std::string& path) {
  struct stat file {};
  return lstat(path.c_str(), &file) == 0 && S_ISSOCK(file.st_mode);
}

void check_path(const std::string& path, const std::string& option) {
  const std::size_t longest = sizeof(sockaddr_un::sun_path) - 1 - std::strlen(kUnborn);
  if (path.empty() || path.size() > longest) {
    throw HilError(option + ": " + path + " has " + std::to_string(path.size()) +
                   " bytes; use 1 to " + std::to_string(longest));
  }
  struct stat file {};
  if (lstat(path.c_str(), &file) != 0) return;
  if (!S_ISSOCK(file.st_mode)) {
    throw HilError(option + ": " + path + " is a file of another kind; choose another path");
  }
  if (is_live(path)) {
    throw HilError(option + ": " + path +
                   " is in use by another emulator; end it or choose another path");
  }
}

}  // namespace

SeqpacketLink::SeqpacketLink(SeqpacketLink&& other) noexcept
    : PacketLink(std::exchange(other.fd_, -1)) {
  closed_ = other.closed_;
}

SeqpacketLink::~SeqpacketLink() {
  if (fd_ >= 0) close(fd_);
}

std::span<const std::uint8_t> SeqpacketLink::take(std::span<std::uint8_t> buffer) noexcept {
  const ssize_t size = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (size > 0) return buffer.first(static_cast<std::size_t>(size));
  if (size == 0 || (errno != EAGAIN && errno != EINTR)) closed_ = true;
  return {};
}

PacketLink::Sent SeqpacketLink::send(std::span<const std::uint8_t> packet) noexcept {
  const ssize_t sent = ::send(fd_, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent >= 0) return Sent::yes;
  if (errno == EAGAIN || errno == EINTR) return Sent::full;
  closed_ = true;
  return Sent::closed;
}

SeqpacketServer::SeqpacketServer(std::string path, const char* option)
    : path_(std::move(path)), option_(option) {
  check_path(path_, option_);
  const std::string unborn = path_ + kUnborn;
  if (is_socket(unborn)) unlink(unborn.c_str());  // of an emulator that was killed
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const sockaddr_un address = address_of(unborn);
  const auto bind_here = [this](const sockaddr* a, socklen_t size) { return bind(fd_, a, size); };
  // One waits while one is served.
  constexpr mode_t kOwnerAlone = S_IRUSR | S_IWUSR;  // bind() makes the file with these rights
  const bool bound =
      fd_ >= 0 && fchmod(fd_, kOwnerAlone) == 0 && with_address(address, bind_here) == 0;
  const bool ready =
      bound && listen(fd_, 1) == 0 && std::rename(unborn.c_str(), path_.c_str()) == 0;
  if (ready) return;
  const int error = errno;
  if (fd_ >= 0) close(fd_);
  if (bound) unlink(unborn.c_str());
  throw HilError(std::string(option_) + ": " + path_ + ": " + std::strerror(error) + "; " +
                 way_out_of(error, "choose a path in a folder that you may write"));
}

SeqpacketServer::~SeqpacketServer() {
  close(fd_);
  unlink(path_.c_str());
}

std::optional<SeqpacketLink> SeqpacketServer::accept(const std::atomic<bool>& stop,
                                                     std::int64_t patience_ns) {
  while (readable_within(fd_, patience_ns, stop)) {
    errno = 0;
    if (auto link = accept_waiting()) return link;
    if (errno == EMFILE || errno == ENFILE) {  // the client goes on waiting
      throw HilError(std::string(option_) + ": " + path_ + ": " + std::strerror(errno) + "; " +
                     way_out_of(errno, ""));
    }
  }
  return std::nullopt;
}

std::optional<SeqpacketLink> SeqpacketServer::accept_waiting() noexcept {
  if (!readable(fd_, 0)) return std::nullopt;
  const int client = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return std::nullopt;
  SeqpacketLink link(client);
  const std::optional<uid_t> stranger = stranger_at(client);
  if (!stranger) return link;
  std::cerr << "kerf-emulator: " << option_ << ": " << one_line(path_) << ": a client of user "
            << *stranger << " was refused; be user " << geteuid() << " or root" << std::endl;
  return std::nullopt;
}

}  // namespace kerf
