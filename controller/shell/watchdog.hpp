// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

#include "controller/device/driver/device_driver.hpp"
#include "controller/shell/real_time.hpp"
#include "controller/shell/servo_loop.hpp"

namespace kerf {

inline constexpr std::chrono::milliseconds kWatchdogPeriod{5};

/// Looks from another thread whether the servo still ticks. When it has stood still for 20 ms the
/// motors go off, once per stall; the loop fades the force in again when it comes back.
class Watchdog {
 public:
  Watchdog(const DeviceDriver& device, LoopSignals& signals) noexcept
      : device_(device), signals_(signals) {}

  /// Call once per `kWatchdogPeriod`.
  void look(std::int64_t now_ns) noexcept {
    const std::uint64_t heartbeat = signals_.heartbeat.load(std::memory_order_relaxed);
    if (heartbeat != last_heartbeat_ || heartbeat == 0) {
      last_heartbeat_ = heartbeat;
      last_change_ns_ = now_ns;
      tripped_ = false;
      return;
    }
    if (tripped_ || now_ns - last_change_ns_ < kStandstillNs) return;
    static_cast<void>(device_.release());
    tripped_ = true;
    ++trips_;
    signals_.stalled.store(true, std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t trips() const noexcept { return trips_; }

 private:
  const DeviceDriver& device_;
  LoopSignals& signals_;
  std::uint64_t last_heartbeat_ = 0;
  std::int64_t last_change_ns_ = 0;
  bool tripped_ = false;
  std::uint64_t trips_ = 0;
};

/// Starts the thread that looks once per `kWatchdogPeriod`, until the jthread is gone: above the
/// servo, so that the servo itself cannot keep it from looking, and on any core but the servo's, so
/// that what takes that core away does not take the watchdog too. With one core, or without the
/// rights, as well as it can.
[[nodiscard]] std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo);

}  // namespace kerf
