// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>

#include "lab/run/grid_run.hpp"
#include "shared/posix/threads.hpp"

/// Watches on a run of a sampled loop: its ticks, and the guard against a step that does not end.
namespace kerf::zwidth {

/// One tick of a run, for a phase portrait: distance of the tip out of the wall, and its speed
/// outwards, along the normal.
struct SwingTick {
  double tip_mm, mm_per_s;
};
/// Called with each tick; may be empty.
using SwingWatch = std::function<void(const SwingTick&)>;

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
