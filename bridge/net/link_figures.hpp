// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace kerf::bridge {

/// What the kernel knows of a TCP connection. glibc's struct ends before these.
struct LinkFigures {
  std::int64_t least_round_trip_ns = 0;  ///< 0: not known yet
  std::uint32_t out_of_order = 0;        ///< packets that waited for a lost one before them
  std::uint64_t received_bytes = 0;      ///< that came in order, TLS and all
};

/// All 0 where the kernel does not tell.
[[nodiscard]] LinkFigures link_figures(int socket) noexcept;

}  // namespace kerf::bridge
