// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/tcp_options.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "shared/posix/failure.hpp"

namespace kerf::bridge {
namespace {

constexpr int kUnsentBytes = 16 * 1024;  // a frame
constexpr int kIdleS = 30;               // before the peer is asked whether it is there
// tcpi_min_rtt, in us, lies at byte 148 of the kernel's tcp_info; glibc's ends before it.
constexpr std::size_t kMinRttWord = 148 / sizeof(std::uint32_t);

bool congestion(int fd, std::string_view name) noexcept {
  return setsockopt(fd, IPPROTO_TCP, TCP_CONGESTION, name.data(),
                    static_cast<socklen_t>(name.size())) == 0;
}

void set(int fd, int level, int option, int value) noexcept {
  setsockopt(fd, level, option, &value, sizeof value);
}

}  // namespace

void tune_socket(int fd) noexcept {
  set(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  set(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, kUnsentBytes);
  set(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(fd, IPPROTO_TCP, TCP_KEEPIDLE, kIdleS);
  congestion(fd, "bbr");
}

void restart_bbr(int fd) noexcept {
  if (congestion(fd, "reno")) congestion(fd, "bbr");
}

std::string why_no_bbr(int fd) {
  if (congestion(fd, "bbr")) return {};
  if (errno == ENOENT) return "the kernel has no BBR (modprobe tcp_bbr)";
  if (errno == EPERM) {
    return "BBR is not allowed (net.ipv4.tcp_allowed_congestion_control)";
  }
  return std::strerror(errno);
}

std::int64_t least_round_trip_ns(int fd) noexcept {
  std::array<std::uint32_t, 64> info{};
  socklen_t bytes = sizeof info;
  if (getsockopt(fd, IPPROTO_TCP, TCP_INFO, info.data(), &bytes) != 0) return 0;
  const std::uint32_t us = info[kMinRttWord];
  return us == ~0U ? 0 : std::int64_t{us} * 1000;  // ~0: none measured
}

}  // namespace kerf::bridge
