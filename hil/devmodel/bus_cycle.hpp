// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

/// The time of the device models: cycles of 125 us (one of FireWire, an eighth of a USB frame),
/// each in four steps of the mechanics.
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

}  // namespace kerf
