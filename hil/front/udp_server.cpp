// SPDX-License-Identifier: Apache-2.0
#include "hil/front/udp_server.hpp"

#include <cerrno>
#include <cstring>
#include <system_error>

#include <netinet/in.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/udp_address.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kGoneNs = 2'000'000'000;  // silence of a host that has left
constexpr int kMaxStrangers = 64;                // datagrams of others, thrown away in one call

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
  refuse(where, std::generic_category().message(cause) + "; " + way_out_of(cause, kUseAnother));
}

}  // namespace

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

UdpServer::UdpServer(const std::string& where) : fd_(bind_to(where)) {}

UdpServer::~UdpServer() {
  close(fd_);
}

std::uint16_t UdpServer::port() const noexcept {
  sockaddr_storage own{};
  socklen_t bytes = sizeof own;
  if (getsockname(fd_, generic(own), &bytes) != 0) return 0;
  // The port stands at the same place in both families.
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
    // An empty datagram only says hello; anything else is the first packet.
    if (size == 0) static_cast<void>(recv(fd_, &first, 1, MSG_DONTWAIT));
    return UdpLink(fd_, host, host_bytes);
  }
  return std::nullopt;
}

}  // namespace kerf
