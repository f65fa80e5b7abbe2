// SPDX-License-Identifier: Apache-2.0
#include "hil/front/socket_servers.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <system_error>
#include <utility>

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/sockets.hpp"

namespace kerf {
namespace {

constexpr const char* kUnborn = ".new";  // ending of its name until the socket listens

template <class Call>
int with_address(const sockaddr_un& address, Call&& call) {
  // The sockets API takes every address as a sockaddr.
  return call(reinterpret_cast<const sockaddr*>(&address), socklen_t{sizeof address});
}

/// Returns true if a process listens at `path`. Connects with another socket type, which no
/// listener notices: the error is ECONNREFUSED only if there is none.
bool is_live(const std::string& path) {
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;  // not proven stale: leave it alone
  const int result = with_address(
      unix_address(path), [fd](const sockaddr* a, socklen_t size) { return connect(fd, a, size); });
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

constexpr std::int64_t kGoneNs = 2'000'000'000;  // after such a silence the host has left
constexpr int kMaxStrangers = 64;                // datagrams of other senders that a call discards

// The sockets API takes every address as a sockaddr.
sockaddr* generic(sockaddr_storage& address) {
  return reinterpret_cast<sockaddr*>(&address);
}

constexpr const char* kUseAnother =
    "use [ADDRESS:]PORT with an address of this machine and a free port";

[[noreturn]] void refuse(const std::string& where, const std::string& why) {
  throw HilError("--udp: " + where + ": " + why);
}

/// A socket bound to `where`.
int bind_to(const std::string& where) {
  const UdpAddress address = resolve_udp(where);
  if (!address.error.empty()) refuse(where, address.error + "; " + kUseAnother);
  const int fd = socket(address.storage.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd >= 0 && bind(fd, address.get(), address.bytes) == 0) return fd;
  const int cause = errno;
  if (fd >= 0) close(fd);
  refuse(where, std::generic_category().message(cause) + "; " + remedy_for(cause, kUseAnother));
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

void SeqpacketLink::hang_up() noexcept {
  shutdown(fd_, SHUT_WR);
}

SeqpacketServer::SeqpacketServer(std::string path, const char* option)
    : path_(std::move(path)), option_(option) {
  check_path(path_, option_);
  const std::string unborn = path_ + kUnborn;
  if (is_socket(unborn)) unlink(unborn.c_str());  // left by an emulator that was killed
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const sockaddr_un address = unix_address(unborn);
  const auto bind_here = [this](const sockaddr* a, socklen_t size) { return bind(fd_, a, size); };
  constexpr mode_t kOwnerAlone = S_IRUSR | S_IWUSR;  // bind() makes the file with these rights
  const bool bound =
      fd_ >= 0 && fchmod(fd_, kOwnerAlone) == 0 && with_address(address, bind_here) == 0;
  // One client may wait while another is served.
  const bool ready =
      bound && listen(fd_, 1) == 0 && std::rename(unborn.c_str(), path_.c_str()) == 0;
  if (ready) return;
  const int error = errno;
  if (fd_ >= 0) close(fd_);
  if (bound) unlink(unborn.c_str());
  throw HilError(std::string(option_) + ": " + path_ + ": " +
                 std::generic_category().message(error) + "; " +
                 remedy_for(error, "choose a path in a folder that you may write"));
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
    // The client stays queued, and accept would fail for ever.
    if (errno == EMFILE || errno == ENFILE) {
      throw HilError(std::string(option_) + ": " + path_ + ": " +
                     std::generic_category().message(errno) + "; " + remedy_for(errno, ""));
    }
  }
  return std::nullopt;
}

std::optional<SeqpacketLink> SeqpacketServer::accept_waiting() noexcept {
  if (!readable(fd_, 0)) return std::nullopt;
  const int client = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return std::nullopt;
  SeqpacketLink link(client);
  const std::optional<uid_t> stranger = other_user_at(client);
  if (!stranger) return link;
  std::cerr << "kerf-emulator: " << option_ << ": " << one_line(path_) << ": a client of user "
            << *stranger << " was refused; be user " << geteuid() << " or root" << std::endl;
  return std::nullopt;
}

UdpLink::UdpLink(int fd, const sockaddr_storage& host, socklen_t host_bytes) noexcept
    : PacketLink(fd), host_(host), host_bytes_(host_bytes), heard_ns_(monotonic_ns()) {}

std::span<const std::uint8_t> UdpLink::take(std::span<std::uint8_t> buffer) noexcept {
  for (int stranger = 0; stranger < kMaxStrangers; ++stranger) {
    sockaddr_storage sender{};
    socklen_t sender_bytes = sizeof sender;
    const ssize_t size =
        recvfrom(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT, generic(sender), &sender_bytes);
    if (size < 0) break;
    if (sender_bytes != host_bytes_ || std::memcmp(&sender, &host_, host_bytes_) != 0) continue;
    heard_ns_ = monotonic_ns();
    if (size > 0) return buffer.first(static_cast<std::size_t>(size));
    closed_ = true;
    return {};
  }
  if (monotonic_ns() - heard_ns_ > kGoneNs) closed_ = true;
  return {};
}

PacketLink::Sent UdpLink::send(std::span<const std::uint8_t> packet) noexcept {
  const ssize_t sent = sendto(fd_, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                              generic(host_), host_bytes_);
  return sent >= 0 ? Sent::yes : Sent::full;  // a host that cannot be reached falls silent
}

void UdpLink::hang_up() noexcept {
  static_cast<void>(send({}));
}

UdpServer::UdpServer(const std::string& where) : fd_(bind_to(where)) {}

UdpServer::~UdpServer() {
  close(fd_);
}

std::uint16_t UdpServer::port() const noexcept {
  sockaddr_storage own{};
  socklen_t bytes = sizeof own;
  if (getsockname(fd_, generic(own), &bytes) != 0) return 0;
  // The port has the same offset in both families.
  return ntohs(reinterpret_cast<const sockaddr_in&>(own).sin_port);
}

std::optional<UdpLink> UdpServer::accept(const std::atomic<bool>& stop, std::int64_t patience_ns) {
  while (readable_within(fd_, patience_ns, stop)) {
    sockaddr_storage host{};
    socklen_t host_bytes = sizeof host;
    std::uint8_t first = 0;
    const ssize_t size =
        recvfrom(fd_, &first, 1, MSG_DONTWAIT | MSG_PEEK, generic(host), &host_bytes);
    if (size < 0) continue;
    // An empty datagram only begins the session; another one is the first packet.
    if (size == 0) static_cast<void>(recv(fd_, &first, 1, MSG_DONTWAIT));
    return UdpLink(fd_, host, host_bytes);
  }
  return std::nullopt;
}

}  // namespace kerf
