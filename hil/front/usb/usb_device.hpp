// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "shared/posix/monotonic_clock.hpp"

/// Common parts of emulated USB devices: time, faults, control requests, bytes of descriptors.
namespace kerf {

/// The clock of an emulated USB device. Any thread.
class UsbClock {
 public:
  virtual ~UsbClock() = default;
  /// In ns; never goes back.
  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  /// The CLOCK_MONOTONIC time at which to check whether this clock has reached `ns`.
  [[nodiscard]] virtual std::int64_t wake_ns(std::int64_t ns) const noexcept = 0;
};

/// The machine's clock.
class MachineClock final : public UsbClock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return monotonic_ns(); }
  [[nodiscard]] std::int64_t wake_ns(std::int64_t ns) const noexcept override { return ns; }
};
inline const MachineClock kMachineClock;

/// The time of an emulated USB device: frames of 1 ms by a clock. Its mechanics catch up cycle by
/// cycle (125 us), and the caller handles the packets that fall due.
class UsbTime {
 public:
  explicit UsbTime(const UsbClock& clock) noexcept : clock_(clock), began_ns_(clock.now_ns()) {}

  /// Advances `device` to the present; `on_packet(packet)` for each of its packets, `frame()` at
  /// the end of the cycle that begins each frame.
  template <class OnPacket, class Frame>
  void catch_up(PacketDevice& device, OnPacket on_packet, Frame frame) {
    const std::int64_t now = (clock_.now_ns() - began_ns_) / kNsPerCycle;
    while (cycle_ < now) {
      ++cycle_;
      device.advance(1);
      for (auto packet = device.next_packet(); !packet.empty(); packet = device.next_packet()) {
        on_packet(packet);
      }
      if (cycle_ % kCyclesPerUsbFrame == 0) frame();
    }
  }
  /// Since the start, in cycles.
  [[nodiscard]] std::int64_t cycle() const noexcept { return cycle_; }
  /// The time to check for the next frame, CLOCK_MONOTONIC.
  [[nodiscard]] std::int64_t next_frame_ns() const noexcept {
    const std::int64_t frame = cycle_ / kCyclesPerUsbFrame + 1;
    return clock_.wake_ns(began_ns_ + frame * kCyclesPerUsbFrame * kNsPerCycle);
  }

 private:
  static constexpr std::int64_t kNsPerCycle = kNsPerSecond / kCyclesPerSecond;
  const UsbClock& clock_;
  std::int64_t began_ns_;
  std::int64_t cycle_ = 0;
};

/// A fault of a device on USB.
enum class UsbFault : std::uint8_t {
  stall,   ///< the endpoint that is read halts until the host clears it (Falcon)
  split,   ///< for 0.1 s the serial line is slow: packets come in pieces (Falcon)
  nak,     ///< for 0.1 s it takes nothing (NAK): writes of the host have to wait (FUSE nodes)
  vanish,  ///< unplugged
  back,    ///< plugged in again, without power having been lost
};

/// Duration of a fault that passes by itself.
inline constexpr int kUsbFaultFrames = 100;

/// A fault and its time.
struct ScriptedUsbFault {
  std::int64_t cycle = 0;  ///< of 125 us, counted from the start
  UsbFault fault = UsbFault::vanish;
  const std::atomic<bool>* when = nullptr;  ///< and not before this is set; any thread may do so
};

/// Plays faults, which are given in the order of time.
class UsbFaultScript {
 public:
  explicit UsbFaultScript(std::vector<ScriptedUsbFault> faults) : faults_(std::move(faults)) {}

  /// Calls `apply(fault)` for each fault that is due in `cycle` or before and was not applied yet.
  template <class Apply>
  void run(std::int64_t cycle, Apply apply) {
    while (next_ < faults_.size() && is_due(faults_[next_], cycle)) apply(faults_[next_++].fault);
  }

 private:
  static bool is_due(const ScriptedUsbFault& entry, std::int64_t cycle) noexcept {
    return entry.cycle <= cycle && (!entry.when || entry.when->load());
  }

  std::vector<ScriptedUsbFault> faults_;
  std::size_t next_ = 0;
};

/// A control request to a USB device, as on the bus (USB 2.0, 9.3).
struct UsbSetup {
  static constexpr std::size_t kBytes = 8;

  std::uint8_t type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

[[nodiscard]] inline UsbSetup setup_of(std::span<const std::uint8_t, UsbSetup::kBytes> b) noexcept {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(b[at] | b[at + 1] << 8);
  };
  return {b[0], b[1], word(2), word(4), word(6)};
}

// Bytes of descriptors.
constexpr int low(std::uint16_t value) noexcept {
  return value & 0xFF;
}
constexpr int high(std::uint16_t value) noexcept {
  return value >> 8;
}
/// Each value is one byte, 0..255.
template <class... Values>
[[nodiscard]] constexpr std::array<std::uint8_t, sizeof...(Values)> usb_bytes(
    Values... values) noexcept {
  return {static_cast<std::uint8_t>(values)...};
}

}  // namespace kerf
