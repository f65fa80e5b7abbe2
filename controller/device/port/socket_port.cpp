// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/socket_port.hpp"

#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/posix/sockets.hpp"

namespace kerf {

SocketPort::SocketPort(const std::filesystem::path& path, int patience_ms,
                       const std::atomic<bool>& stop) {
  const std::string text = path.string();
  if (text.empty()) {
    throw std::runtime_error("--port socket: no path; name the one of kerf-emulator --socket");
  }
  if (text.size() >= sizeof(sockaddr_un::sun_path)) {
    throw std::runtime_error("--port socket:" + text + ": a socket path has at most " +
                             std::to_string(sizeof(sockaddr_un::sun_path) - 1) +
                             " bytes; use a shorter one");
  }
  const sockaddr_un address = unix_address(text);
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  for (;;) {
    fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd_ >= 0 &&
        // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): the sockets API asks for it
        connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      return;
    }
    const int error = errno;
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
    const bool lacks_files = error == EMFILE || error == ENFILE;
    if (lacks_files || stop || std::chrono::steady_clock::now() >= give_up) {
      const std::string start = "start kerf-emulator --front socket --socket " + text;
      throw std::runtime_error("--port socket:" + text + ": no device answers (" +
                               std::generic_category().message(error) + "); " +
                               remedy_for(error, start.c_str()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

SocketPort::~SocketPort() {
  if (fd_ >= 0) close(fd_);
}

std::size_t SocketPort::receive(std::span<std::uint8_t> out) noexcept {
  if (closed_) return 0;
  const ssize_t size = recv(fd_, out.data(), out.size(), MSG_DONTWAIT | MSG_TRUNC);
  if (size > 0) return static_cast<std::size_t>(size);
  // No packet is empty: 0 is the end of a SEQPACKET socket, and the goodbye over UDP.
  if (size == 0 || (errno != EAGAIN && errno != EINTR)) closed_ = true;
  return 0;
}

bool SocketPort::send(std::span<const std::uint8_t> packet) noexcept {
  const auto sends = [&] {
    return ::send(fd_, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL) ==
           static_cast<ssize_t>(packet.size());
  };
  if (sends()) return true;
  if (errno == EPIPE || errno == ECONNRESET || errno == ENOTCONN || errno == ECONNREFUSED) {
    closed_ = true;
  }
  // Over UDP this may be the refusal of an earlier packet, and this one has not left.
  return errno == ECONNREFUSED && sends();
}

bool SocketPort::wait(int milliseconds) noexcept {
  pollfd watched{fd_, POLLIN, 0};
  int ready = -1;
  while (!closed_ && (ready = poll(&watched, 1, milliseconds)) < 0 && errno == EINTR) {
  }
  return ready > 0;
}

namespace {

constexpr int kRefusalMs = 50;  // a refusal comes as fast as an answer

[[noreturn]] void refuse_address(const std::string& where, const std::string& why) {
  throw std::runtime_error("--port udp:" + where + ": " + why +
                           "; name the [ADDRESS:]PORT of kerf-emulator --front udp");
}

/// Greets the peer; returns 0, or the error of its refusal.
int greet(int fd) noexcept {
  pollfd refusal{fd, POLLIN, 0};
  char first = 0;
  const bool is_refused = send(fd, nullptr, 0, MSG_NOSIGNAL) < 0 ||
                          (poll(&refusal, 1, kRefusalMs) > 0 && recv(fd, &first, 1, MSG_PEEK) < 0);
  return is_refused ? errno : 0;
}

/// A socket that receives from the peer alone, which did not refuse it.
int connect_to(const std::string& where, int patience_ms, const std::atomic<bool>& stop) {
  const UdpAddress address = resolve_udp(where);
  if (!address.error.empty()) refuse_address(where, address.error);
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  for (;;) {
    const int fd = socket(address.storage.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    int error = fd < 0 || connect(fd, address.get(), address.bytes) != 0 ? errno : 0;
    if (error == 0) error = greet(fd);
    if (error == 0) return fd;
    if (fd >= 0) close(fd);
    if (stop || std::chrono::steady_clock::now() >= give_up) {
      refuse_address(where, "no device answers (" + std::generic_category().message(error) + ")");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(kRefusalMs));
  }
}

}  // namespace

UdpPort::UdpPort(const std::string& where, int patience_ms, const std::atomic<bool>& stop)
    : SocketPort(connect_to(where, patience_ms, stop)) {}

UdpPort::~UdpPort() {
  if (!closed()) send({});
}

}  // namespace kerf
