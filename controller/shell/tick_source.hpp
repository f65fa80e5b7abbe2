// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/device/driver/device_driver.hpp"
#include "controller/shell/clock.hpp"
#include "controller/shell/tick_leash.hpp"

namespace kerf {

/// A servo whose ticks begin so far apart has stood still: what it last felt is no longer true.
inline constexpr std::int64_t kStandstillNs = 20'000'000;

/// Tells a tick that began kStandstillNs or more after the last one. One thread.
class StandstillWatch {
 public:
  /// Once per tick, at its start.
  [[nodiscard]] bool stood_still(std::int64_t now_ns) noexcept {
    const bool stood_still = began_ns_ > 0 && now_ns - began_ns_ >= kStandstillNs;
    began_ns_ = now_ns;
    return stood_still;
  }

 private:
  std::int64_t began_ns_ = 0;  ///< the last tick; 0: there was none
};

/// What starts a tick: the clock, or in lock-step the device's next report.
class TickSource {
 public:
  virtual ~TickSource() = default;
  /// Waits for the next tick and returns how late it starts, in ns.
  virtual std::int64_t wait_next() noexcept = 0;
  /// Deadlines that were skipped because a tick ran over.
  [[nodiscard]] virtual std::uint64_t overruns() const noexcept = 0;
  /// Whether this tick began kStandstillNs or more after the last one; never where no clock runs.
  [[nodiscard]] virtual bool stood_still() const noexcept { return false; }
};

/// Real time: absolute deadlines.
class RealTimeTicks final : public TickSource {
 public:
  RealTimeTicks(std::int64_t period_ns, std::int64_t spin_ns) noexcept
      : clock_(period_ns, spin_ns) {}
  std::int64_t wait_next() noexcept override {
    const std::int64_t late_ns = clock_.wait_next();
    stood_still_ = watch_.stood_still(monotonic_ns());
    return late_ns;
  }
  [[nodiscard]] std::uint64_t overruns() const noexcept override { return clock_.overruns(); }
  [[nodiscard]] bool stood_still() const noexcept override { return stood_still_; }

 private:
  DeadlineClock clock_;
  StandstillWatch watch_;
  bool stood_still_ = false;
};

/// Virtual time: one tick per report, as fast as both ends go. After a device has been silent for
/// two seconds of real time, ticks pass without a report until it speaks again. With a leash, each
/// tick first waits until the leash allows it.
class LockStepTicks final : public TickSource {
 public:
  explicit LockStepTicks(DeviceDriver& device, TickLeash* leash = nullptr) noexcept
      : device_(device), leash_(leash) {}
  std::int64_t wait_next() noexcept override {
    if (leash_ != nullptr) leash_->wait_for(++tick_);
    silent_ = !device_.wait(silent_ ? 0 : kPatienceMs);
    return 0;
  }
  [[nodiscard]] std::uint64_t overruns() const noexcept override { return 0; }

 private:
  static constexpr int kPatienceMs = 2000;
  DeviceDriver& device_;
  TickLeash* leash_;
  std::uint64_t tick_ = 0;
  bool silent_ = false;
};

}  // namespace kerf
