// SPDX-License-Identifier: Apache-2.0

#include "bridge/net/tcp_socket.hpp"

#include <cerrno>
#include <cstring>
#include <limits>
#include <string_view>

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "shared/posix/error_text.hpp"

namespace kerf::bridge {
namespace {

constexpr int kUnsentBytes = 16 * 1024;  // a frame
constexpr int kIdleS = 30;               // before the peer is asked whether it is there

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

LinkFigures link_figures(int socket) noexcept {
  tcp_info info{};
  socklen_t bytes = sizeof info;
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &bytes) != 0) return {};
  // The kernel starts with the largest number.
  const bool known = info.tcpi_min_rtt != std::numeric_limits<std::uint32_t>::max();
  return {known ? std::int64_t{info.tcpi_min_rtt} * 1000 : 0, info.tcpi_rcv_ooopack,
          info.tcpi_bytes_received};
}

}  // namespace kerf::bridge
