// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "shared/segment/layout.hpp"

// Ticks of a running controller as JSON over UDP, as PlotJuggler's "UDP Server" takes them.

namespace kerf {

/// PlotJuggler's port.
inline constexpr const char* kPlotJugglerUdp = "127.0.0.1:9870";

/// One tick as a JSON object: `timestamp`, its start in seconds, and in `kerf` the columns of
/// docs/log.md, arrays as arrays; those of a second arm in `kerf_2`. It leaves out hashes and
/// checksum, which are not quantities, and columns with a NaN, which JSON cannot represent.
[[nodiscard]] std::string tick_json(const TickRecord& record, const TickRecord* second = nullptr);

struct LiveOptions {
  std::string name;
  std::string udp = kPlotJugglerUdp;  ///< [ADDRESS:]PORT
  std::uint32_t every = 1;            ///< one datagram for so many ticks
};

/// Sends a datagram for each tick of controller `options.name` from now on, until it ends or
/// `stop`. A receiver may start and end at any time. It only reads the segment, so it does not
/// affect the servo. Returns the exit code, 0. Throws `SegmentError` if there is no such
/// controller, UsageError for an invalid address.
[[nodiscard]] int send_live(const LiveOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf
