// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "controller/device/driver/device_driver.hpp"
#include "controller/servo/servo.hpp"
#include "controller/shell/publisher.hpp"
#include "controller/shell/run_record.hpp"
#include "controller/shell/tick_source.hpp"
#include "controller/shell/waiting.hpp"
#include "shared/segment/hand_over.hpp"

namespace kerf {

/// Why the loop ended; `unexpected_call` is what `--guard` makes of a stop of its own.
enum class EndReason : std::uint8_t {
  ticks_done,
  stopped,
  device_gone,
  never_armed,
  unexpected_call
};

struct LoopLimits {
  std::uint64_t armed_ticks = UINT64_MAX;   ///< servo steps after arming
  std::uint64_t gone_ticks = 2000;          ///< without a report: 2 s
  std::uint64_t arming_ticks = UINT64_MAX;  ///< patience for the first docking
};

/// What the loop shares with other threads.
struct LoopSignals {
  std::atomic<bool>& stop;                        ///< asked by a signal
  std::atomic<bool> stalled{false};               ///< the watchdog switched the motors off
  std::atomic<std::uint64_t> heartbeat{0};        ///< ticks so far: the watchdog's pulse
  std::atomic<std::uint64_t> armed_ticks{0};      ///< for the progress bar
  std::atomic<Waiting> waiting{Waiting::report};  ///< of the device, after the last tick
};

/// What a tick does first: force begins anew where the servo has stood still, told by its watchdog,
/// or by the clock where what stopped the one stopped the other too. Names what told; none:
/// nullptr.
inline const char* recover(LoopSignals& signals, bool stood_still, Servo& servo) noexcept {
  const bool watchdog_tripped = signals.stalled.exchange(false, std::memory_order_relaxed);
  if (!watchdog_tripped && !stood_still) return nullptr;
  static_cast<void>(servo.apply({.kind = ServoCommand::Kind::fade_in}));
  return watchdog_tripped ? "watchdog" : "stood_still";
}

/// Sends what a tick decided. A tick that was itself the stall is late: nothing of it, and the next
/// one fades in.
inline void send_tick(const ServoOutput& output, const LoopSignals& signals,
                      DeviceDriver& device) noexcept {
  if (signals.stalled.load(std::memory_order_relaxed)) {
    device.release();
  } else {
    device.command(output);
  }
}

/// The loop around the servo step: time, device, step, device, eyes, statistics. Runs on the
/// calling thread until a limit is met or somebody asks to stop; the motors are off when it
/// returns.
EndReason run_servo(TickSource& clock, DeviceDriver& device, Servo& servo, Publisher& eyes,
                    SegmentServer& commands, const LoopLimits& limits, LoopSignals& signals,
                    RunRecord& record) noexcept;

}  // namespace kerf
