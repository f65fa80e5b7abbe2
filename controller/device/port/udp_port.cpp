// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/udp_port.hpp"

#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "shared/posix/udp_address.hpp"

namespace kerf {
namespace {

constexpr int kRefusalMs = 50;  // a refusal comes as fast as an answer

[[noreturn]] void refuse_address(const std::string& where, const std::string& why) {
  throw std::runtime_error("--port udp:" + where + ": " + why +
                           "; name the [ADDRESS:]PORT of kerf-emulator --front udp");
}

/// Greets the other end; 0, or the error with which it refuses.
int greet(int fd) noexcept {
  pollfd refusal{fd, POLLIN, 0};
  char first = 0;
  const bool is_refused = send(fd, nullptr, 0, MSG_NOSIGNAL) < 0 ||
                          (poll(&refusal, 1, kRefusalMs) > 0 && recv(fd, &first, 1, MSG_PEEK) < 0);
  return is_refused ? errno : 0;
}

/// A socket that hears nobody but the other end, which did not refuse_address it.
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
  send({});
}

}  // namespace kerf
