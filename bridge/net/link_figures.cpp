// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/link_figures.hpp"

#include <limits>

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace kerf::bridge {

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
