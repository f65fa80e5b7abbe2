// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/posix/monotonic_clock.hpp"

namespace kerf {

/// Absolute deadlines on CLOCK_MONOTONIC: lateness never adds up. A deadline that is late by a
/// whole period or more is skipped and counted, never caught up in a burst; one that is late by
/// less is served late.
class DeadlineClock {
 public:
  /// `spin_ns` of each period are spent spinning before the deadline, which removes the timer's
  /// wake-up latency (about 15 us on a virtual machine) for that share of one core.
  DeadlineClock(std::int64_t period_ns, std::int64_t spin_ns) noexcept
      : period_ns_(period_ns), spin_ns_(spin_ns), deadline_ns_(monotonic_ns()) {}

  /// Waits for the next deadline and returns how late the wake-up was. An interrupted sleep goes
  /// on.
  std::int64_t wait_next() noexcept {
    deadline_ns_ += period_ns_;
    std::int64_t now = monotonic_ns();
    if (now >= deadline_ns_ + period_ns_) {
      const std::int64_t missed = (now - deadline_ns_) / period_ns_;
      overruns_ += static_cast<std::uint64_t>(missed);
      deadline_ns_ += missed * period_ns_;
    }
    sleep_until_ns(deadline_ns_ - spin_ns_);
    do now = monotonic_ns();
    while (now < deadline_ns_);
    return now - deadline_ns_;
  }

  [[nodiscard]] std::uint64_t overruns() const noexcept { return overruns_; }

 private:
  std::int64_t period_ns_;
  std::int64_t spin_ns_;
  std::int64_t deadline_ns_;
  std::uint64_t overruns_ = 0;
};

}  // namespace kerf
