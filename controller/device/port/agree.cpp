// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/agree.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>

#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kRepeatNs = 200 * kNsPerMs;
constexpr int kLookMs = 50;  // how long a stop request may wait

}  // namespace

void agree(PacketPort& port, const std::string& place, const Hello& ours, bool is_lossy,
           int patience_ms, const std::atomic<bool>& stop) {
  const HelloBytes hello = encode(ours);
  const std::int64_t give_up_ns = monotonic_ns() + patience_ms * kNsPerMs;
  std::int64_t say_at_ns = 0;
  std::array<std::uint8_t, kHelloBytes> packet;
  for (std::int64_t now_ns = monotonic_ns(); now_ns < give_up_ns && !stop && !port.closed();
       now_ns = monotonic_ns()) {
    if (now_ns >= say_at_ns && port.send(hello)) {
      say_at_ns = is_lossy ? now_ns + kRepeatNs : std::numeric_limits<std::int64_t>::max();
    }
    if (!port.wait(kLookMs)) continue;
    const std::size_t size = port.receive(packet);
    if (size != packet.size()) continue;  // of the device
    const auto theirs = decode_hello(packet);
    if (!theirs) continue;
    const std::string reason = discord(ours, *theirs);
    if (reason.empty()) return;
    throw std::runtime_error(place + ": " + reason);
  }
  if (port.closed()) {
    throw std::runtime_error(place +
                             ": the emulator closed the link; see what it says, and start it with "
                             "--stay where clients come one after another");
  }
  throw std::runtime_error(place + ": nobody answers the hello of this controller within " +
                           std::to_string(patience_ms / 1000) +
                           " s; end the client that the emulator serves, or start kerf-emulator "
                           "of this version");
}

}  // namespace kerf
