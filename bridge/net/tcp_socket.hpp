// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace kerf::bridge {

/// Sets TCP_NODELAY, keepalive, BBR (fast on links that lose packets) and a small
/// TCP_NOTSENT_LOWAT, so that data is fresh when it leaves. The send buffer keeps the kernel's
/// size: a small one slows down a join over a link with loss. Options that the kernel lacks stay
/// unset.
void tune_socket(int fd) noexcept;

/// Restarts BBR before it probes for the round trip, with four packets under way: the picture is
/// fresher, and other users of the link get less.
void restart_bbr(int fd) noexcept;

/// Empty if the kernel has BBR and allows it, else the reason.
[[nodiscard]] std::string why_no_bbr(int fd);

/// The kernel's figures of a TCP connection that glibc's struct does not have.
struct LinkFigures {
  std::int64_t least_round_trip_ns = 0;  ///< 0: not known yet
  std::uint32_t out_of_order = 0;        ///< packets that waited for a lost one before them
  std::uint64_t received_bytes = 0;      ///< that came in order, TLS and all
};

/// All 0 if the kernel does not report them.
[[nodiscard]] LinkFigures link_figures(int socket) noexcept;

}  // namespace kerf::bridge
