// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <mutex>
#include <string>
#include <thread>

#include "lab/run/grid_run.hpp"
#include "shared/posix/threads.hpp"

/// Verdicts on a run of a sampled loop: whether it goes on swinging, and the guard against a step
/// that does not end.
namespace kerf::zwidth {

/// The verdict on a run, by two rules.
struct LimitCycle {
  /// The tip's travel in the last third is above three encoder steps, and at least 0.97 of that in
  /// the middle third: it does not die out.
  bool swings = false;
  /// The wall gives energy in the last third, more than a push over three encoder steps takes, and
  /// at least 0.94 (0.97 squared) of its energy in the middle third.
  bool active = false;
  double travel_mm = 0;  ///< in the last third
  double given_mj = 0;   ///< by the motors to tip and hand: rise of the maximum in the last third
  double port_minimum_mj = 0;  ///< lowest energy of the device port in a run that begins at 0

  /// The worse of two runs.
  void join(const LimitCycle& other) noexcept {
    swings = swings || other.swings;
    active = active || other.active;
    travel_mm = std::max(travel_mm, other.travel_mm);
    given_mj = std::max(given_mj, other.given_mj);
    port_minimum_mj = std::min(port_minimum_mj, other.port_minimum_mj);
  }
};

/// One tick of a run, for a phase portrait: distance of the tip out of the wall, and its speed
/// outwards, along the normal.
struct SwingTick {
  double tip_mm, mm_per_s;
};
/// Called with each tick; may be empty.
using SwingWatch = std::function<void(const SwingTick&)>;

/// Follows one run of a known number of ticks.
class LimitCycleDetector {
 public:
  static constexpr double kGoesOn = 0.97;  ///< travel of a third over that of the one before

  LimitCycleDetector(std::int64_t ticks, double step_mm, double push_n) noexcept
      : ticks_(ticks), least_mm_(std::max(3 * step_mm, kLeastMm)), least_mj_(least_mm_ * push_n) {}

  /// Once per tick: position of the tip, and energy given by the motors since the start (N mm).
  void take(double tip_mm, double given_mj) noexcept {
    const auto third = static_cast<std::size_t>(std::min<std::int64_t>(2, tick_ * 3 / ticks_));
    Third& now = thirds_[third];
    now.lowest_mm = std::min(now.lowest_mm, tip_mm);
    now.highest_mm = std::max(now.highest_mm, tip_mm);
    now.given_mj = std::max(now.given_mj, given_mj);
    if (tick_ == 0) first_given_mj_ = given_mj;
    port_minimum_mj_ = std::min(port_minimum_mj_, first_given_mj_ - given_mj);
    ++tick_;
  }

  /// Of a run that has come to rest before its end.
  [[nodiscard]] LimitCycle rest() const noexcept { return {.port_minimum_mj = port_minimum_mj_}; }

  [[nodiscard]] LimitCycle swing() const noexcept {
    const double before = travel(thirds_[1]), last = travel(thirds_[2]);
    const double gave = thirds_[1].given_mj - thirds_[0].given_mj;
    LimitCycle swing = rest();
    swing.travel_mm = last;
    swing.given_mj = thirds_[2].given_mj - thirds_[1].given_mj;
    swing.swings = last > least_mm_ && last >= kGoesOn * before;
    swing.active = swing.given_mj > least_mj_ && swing.given_mj >= kGoesOn * kGoesOn * gave;
    return swing;
  }

 private:
  /// Below the step of any encoder: a loop without encoder steps counts as at rest within it.
  static constexpr double kLeastMm = 1e-4;

  struct Third {
    double lowest_mm = std::numeric_limits<double>::infinity();
    double highest_mm = -std::numeric_limits<double>::infinity();
    double given_mj = -std::numeric_limits<double>::infinity();
  };
  static double travel(const Third& third) noexcept {
    return std::max(0.0, third.highest_mm - third.lowest_mm);
  }

  std::int64_t ticks_;
  double least_mm_, least_mj_;
  std::int64_t tick_ = 0;
  std::array<Third, 3> thirds_{};
  double first_given_mj_ = 0, port_minimum_mj_ = 0;
};

/// Ticks that a column took, and the request to end it half-way. Each thread has its own; others
/// may read the count.
class StepCounter {
 public:
  StepCounter() = default;
  explicit StepCounter(const std::atomic<bool>& stop) : stop_(&stop) {}

  /// Once per tick. Throws Interrupted within some milliseconds of the request.
  void tick() {
    constexpr std::uint64_t kLook = 1024;
    const std::uint64_t ticks = ticks_.load(std::memory_order_relaxed) + 1;
    ticks_.store(ticks, std::memory_order_relaxed);
    if (ticks % kLook == 0 && stop_ != nullptr && stop_->load(std::memory_order_relaxed)) {
      throw Interrupted();
    }
  }
  [[nodiscard]] const std::atomic<std::uint64_t>& ticks() const { return ticks_; }

 private:
  const std::atomic<bool>* stop_ = nullptr;
  std::atomic<std::uint64_t> ticks_{0};
};

/// Watches the threads that measure. If a step of one does not end, as in a law that loops, that
/// thread cannot be ended: the program reports the law, and ends with 2.
class TickWatch {
  struct Measured {
    StepWatchdog step;
    std::string what;
  };

 public:
  /// `results` is held while the program ends, so that no file is left half written.
  explicit TickWatch(std::mutex& results);

  /// While it lives, the thread that made it is watched.
  class Watched {
   public:
    Watched(TickWatch& watch, const StepCounter& ticks, std::string what);
    ~Watched();
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

   private:
    TickWatch& watch_;
    std::list<Measured>::iterator place_;
  };

 private:
  void look();

  std::mutex& results_;
  std::mutex lock_;
  std::list<Measured> measured_;
  std::jthread thread_;  // last: it ends before the members that it reads
};

}  // namespace kerf::zwidth
