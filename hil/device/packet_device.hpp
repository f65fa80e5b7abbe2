// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

/// An emulated device as a stream of packets over bus cycles. The time of the device models is
/// counted in these cycles: 125 us each (one of FireWire, an eighth of a USB frame), in four steps
/// of the mechanics.
namespace kerf {

inline constexpr int kCyclesPerSecond = 8000;
inline constexpr int kUsbFramesPerSecond = 1000;
inline constexpr int kCyclesPerUsbFrame = kCyclesPerSecond / kUsbFramesPerSecond;
inline constexpr double kCycleS = 1.0 / kCyclesPerSecond;
inline constexpr int kStepsPerCycle = 4;  // 31 us: far below the fastest spring-mass period here
inline constexpr double kStepS = kCycleS / kStepsPerCycle;

[[nodiscard]] inline std::int64_t cycles_of(double seconds) noexcept {
  return std::llround(seconds * kCyclesPerSecond);
}

/// The 1 ms frames of a USB bus, counted in cycles.
class UsbFrames {
 public:
  /// One cycle; true when a frame begins.
  [[nodiscard]] bool step() noexcept {
    cycle_ = (cycle_ + 1) % kCyclesPerUsbFrame;
    return cycle_ == 0;
  }

 private:
  int cycle_ = 0;
};

/// A device as a front sees it: packets in, bus cycles of 125 us, packets out. Called by one
/// thread.
class PacketDevice {
 public:
  virtual ~PacketDevice() = default;

  /// A packet of the host as it came; one that is no command is counted and ignored.
  virtual void receive(std::span<const std::uint8_t> packet) noexcept = 0;
  virtual void advance(int cycles) noexcept = 0;
  /// The packet that is due now, valid until the next call; empty if none is (any more). Several
  /// may be due after one `advance`.
  [[nodiscard]] virtual std::span<const std::uint8_t> next_packet() noexcept = 0;
  /// It has ended its side of the link: it sends nothing any more, and still receives.
  [[nodiscard]] virtual bool hung_up() const noexcept { return false; }
};

}  // namespace kerf
