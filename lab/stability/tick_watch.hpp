// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <pthread.h>

#include "lab/run/grid_run.hpp"
#include "shared/posix/program.hpp"
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
  explicit TickWatch(std::mutex& results)
      : results_(results), thread_([this](const std::stop_token& stop) {
          std::mutex own;
          std::unique_lock wait(own);
          std::condition_variable_any told;
          constexpr std::chrono::milliseconds kPeriod{200};
          while (!stop.stop_requested()) {
            look();
            told.wait_for(wait, stop, kPeriod, [] { return false; });
          }
        }) {}

  /// While it lives, the thread that made it is watched.
  class Watched {
   public:
    Watched(TickWatch& watch, const StepCounter& ticks, std::string what) : watch_(watch) {
      const std::scoped_lock hold(watch.lock_);
      place_ = watch.measured_.insert(
          watch.measured_.end(), {StepWatchdog(pthread_self(), ticks.ticks()), std::move(what)});
    }
    ~Watched() {
      const std::scoped_lock hold(watch_.lock_);
      watch_.measured_.erase(place_);
    }
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

   private:
    TickWatch& watch_;
    std::list<Measured>::iterator place_;
  };

 private:
  void look() {
    const std::scoped_lock hold(lock_);
    for (Measured& measured : measured_) {
      if (!measured.step.look()) continue;
      const std::scoped_lock files(results_);
      ProgressBar(true).hide();
      std::fprintf(stderr,
                   "kerf-lab: %s: a step did not end in %d s; give every loop of your law a bound "
                   "that does not depend on its input; a --part keeps the columns that it has\n",
                   measured.what.c_str(), StepWatchdog::kMostSeconds);
      std::_Exit(2);
    }
  }

  std::mutex& results_;
  std::mutex lock_;
  std::list<Measured> measured_;
  std::jthread thread_;  // last: it ends before the members that it reads
};

}  // namespace kerf::zwidth
