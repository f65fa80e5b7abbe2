// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf {

inline constexpr std::int64_t kBusCyclesPerSecond = omni::kBusCyclesPerSecond;
inline constexpr int kTicksPerCycle = 3072;  ///< of the bus's 24.576 MHz clock
inline constexpr std::int64_t kNsPerBusCycle = kNsPerSecond / kBusCyclesPerSecond;

/// A bus begins late in its 128 s, so that every run sees its counters wrap.
inline constexpr std::int64_t kFirstCycle = 125 * kBusCyclesPerSecond;

/// 3 bits of the second and 13 bits of the cycle: the time stamp of an isochronous packet.
[[nodiscard]] constexpr std::uint16_t iso_stamp(std::int64_t cycle) noexcept {
  const auto second = static_cast<std::uint64_t>(cycle / kBusCyclesPerSecond) & 7;
  return static_cast<std::uint16_t>(second << 13 |
                                    static_cast<std::uint64_t>(cycle % kBusCyclesPerSecond));
}

/// 7 bits of the second, 13 of the cycle, 12 of the offset: the cycle timer of a controller.
[[nodiscard]] constexpr std::uint32_t cycle_timer(std::int64_t cycle, int ticks) noexcept {
  const auto second = static_cast<std::uint64_t>(cycle / kBusCyclesPerSecond) & 127;
  const auto within = static_cast<std::uint64_t>(cycle % kBusCyclesPerSecond);
  return static_cast<std::uint32_t>(second << 25 | within << 12 | static_cast<unsigned>(ticks));
}

/// Which bus cycle (125 us) it is: by the machine's clock, or in lock-step by request.
class BusClock {
 public:
  /// `drift_ppm` is how much slower than the machine's clock the bus runs.
  static BusClock real_time(double drift_ppm = 0) noexcept {
    BusClock clock;
    clock.began_ns_ = monotonic_ns();
    clock.ns_per_cycle_ = static_cast<double>(kNsPerBusCycle) * (1 + drift_ppm * 1e-6);
    return clock;
  }
  static BusClock lock_step() noexcept { return {}; }

  [[nodiscard]] bool is_lock_step() const noexcept { return ns_per_cycle_ == 0; }

  /// The cycle that runs at a time of CLOCK_MONOTONIC, and how far it has come, in bus ticks.
  struct Instant {
    std::int64_t cycle;
    int ticks;
  };
  [[nodiscard]] Instant at(std::int64_t ns) const noexcept {
    if (is_lock_step()) return {cycle_, 0};
    const double cycles = static_cast<double>(ns - began_ns_) / ns_per_cycle_;
    const double whole = std::floor(cycles);
    return {kFirstCycle + static_cast<std::int64_t>(whole),
            static_cast<int>((cycles - whole) * kTicksPerCycle)};
  }
  [[nodiscard]] std::int64_t cycle() const noexcept {
    return is_lock_step() ? cycle_ : at(monotonic_ns()).cycle;
  }
  /// When `cycle` begins, CLOCK_MONOTONIC; only in real time.
  [[nodiscard]] std::int64_t begin_ns(std::int64_t cycle) const noexcept {
    const double since = static_cast<double>(cycle - kFirstCycle) * ns_per_cycle_;
    return began_ns_ + static_cast<std::int64_t>(std::ceil(since));
  }
  /// Only in lock-step.
  void advance(std::int64_t cycles) noexcept { cycle_ += cycles; }

 private:
  std::int64_t began_ns_ = 0;
  double ns_per_cycle_ = 0;
  std::int64_t cycle_ = kFirstCycle;
};

}  // namespace kerf
