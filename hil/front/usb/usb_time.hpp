// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hil/devmodel/bus_cycle.hpp"
#include "hil/devmodel/packet_device.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {

/// The time of an emulated USB device: frames of 1 ms by the machine's clock. Its mechanics catch
/// up cycle by cycle (125 us), and whoever drives this handles the packets that fall due.
class UsbTime {
 public:
  /// Advances `device` to the present; `hear(packet)` for each of its packets, `frame()` at the end
  /// of the cycle that begins each frame.
  template <class Hear, class Frame>
  void catch_up(PacketDevice& device, Hear hear, Frame frame) {
    const std::int64_t now = (monotonic_ns() - began_ns_) / kNsPerCycle;
    while (cycle_ < now) {
      ++cycle_;
      device.advance(1);
      for (auto packet = device.next_packet(); !packet.empty(); packet = device.next_packet()) {
        hear(packet);
      }
      if (cycle_ % kCyclesPerUsbFrame == 0) frame();
    }
  }
  /// Since the start, in cycles.
  [[nodiscard]] std::int64_t cycle() const noexcept { return cycle_; }
  /// When the next frame begins, CLOCK_MONOTONIC.
  [[nodiscard]] std::int64_t next_frame_ns() const noexcept {
    const std::int64_t frame = cycle_ / kCyclesPerUsbFrame + 1;
    return began_ns_ + frame * kCyclesPerUsbFrame * kNsPerCycle;
  }

 private:
  static constexpr std::int64_t kNsPerCycle = kNsPerSecond / kCyclesPerSecond;
  std::int64_t began_ns_ = monotonic_ns();
  std::int64_t cycle_ = 0;
};

}  // namespace kerf
