// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace kerf::bridge {

/// What a viewer's socket is set to: no waiting for more to send, few unsent bytes, so that none
/// grows stale, a look whether the peer is still there, and BBR, which bears loss. The size of the
/// send buffer is the kernel's business: a small one makes joins over lossy links slow.
void tune_socket(int fd) noexcept;

/// A new BBR in place of the old one, which would soon go and probe for the round trip with four
/// packets under way: fresher, and unfair to whoever shares the link.
void restart_bbr(int fd) noexcept;

/// Empty if BBR is to be had, else why not.
[[nodiscard]] std::string why_no_bbr(int fd);

/// What the kernel knows of a TCP connection. glibc's struct ends before these.
struct LinkFigures {
  std::int64_t least_round_trip_ns = 0;  ///< 0: not known yet
  std::uint32_t out_of_order = 0;        ///< packets that waited for a lost one before them
  std::uint64_t received_bytes = 0;      ///< that came in order, TLS and all
};

/// All 0 if the kernel does not report them.
[[nodiscard]] LinkFigures link_figures(int socket) noexcept;

}  // namespace kerf::bridge
