// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "standin/hd/numbers.hpp"
#include "standin/ledger.hpp"

namespace kerf::hd {

/// The servo thread of the HD stand-in and the callbacks that it runs once a tick, by falling
/// priority.
///
/// In real time it keeps absolute deadlines; a deadline that is missed by a period or more is
/// counted and skipped. In lock-step, time stands still while no callback is scheduled. A tick
/// takes a lock for the list of callbacks, never while one runs. Any thread may call; `stop` of a
/// callback takes effect after its tick.
class Scheduler {
 public:
  /// `begin` and `end` of each tick, on the servo thread.
  struct Tick {
    std::function<void()> begin, end;
  };
  static constexpr std::size_t kMostCallbacks = 256;  ///< the vendor's limit is not known

  Scheduler(Tick tick, standin::Ledger& ledger, int stall_ms)
      : tick_(std::move(tick)), ledger_(ledger), stall_us_(std::int64_t{stall_ms} * 1000) {}

  /// `priority`: as in Settings. Nothing if it runs.
  void start(bool lockstep, int rate_hz, int priority);
  /// Returns once a stop that has begun is over; not from a callback, in whose tick it takes
  /// effect.
  void finish_stop();
  void stop();
  [[nodiscard]] bool runs() const noexcept { return runs_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool is_servo_thread() const noexcept;
  /// Whether this tick is the last one, because of a stop.
  [[nodiscard]] bool stops() const noexcept { return runs() && ends_; }

  /// Returns a handle, 0 if there are too many.
  [[nodiscard]] Ulong add(Callback callback, void* data, std::uint16_t priority);
  /// Runs it in ticks of the caller until it is done: before the start, or from a callback.
  void run_here(Callback callback, void* data);
  /// Runs it in ticks of the servo thread until it is done, or the scheduler has stopped: then it
  /// is never called again, because `data` may end with the caller. Returns false if there are too
  /// many.
  [[nodiscard]] bool run_there(Callback callback, void* data, std::uint16_t priority);
  /// Returns once no callback of that handle runs any more; false if there is none.
  bool remove(Ulong handle);
  [[nodiscard]] bool has(Ulong handle);
  /// Returns once that callback is done, or the scheduler has stopped.
  void wait(Ulong handle);

  /// Since the current tick began, s; in lock-step 0.
  [[nodiscard]] double since_tick_s() const noexcept;

 private:
  struct Entry {
    Ulong handle;
    Callback callback;
    void* data;
    std::uint16_t priority;
  };

  void serve(bool lockstep, int rate_hz);
  void run_callbacks();
  [[nodiscard]] bool contains(Ulong handle) const noexcept;  ///< with the lock
  void erase(Ulong handle) noexcept;                         ///< with the lock
  void wait(std::unique_lock<std::mutex>& lock, Ulong handle);

  Tick tick_;
  standin::Ledger& ledger_;
  std::int64_t stall_us_;
  std::mutex starts_;   ///< held by a start and by a stop, not by one of a callback
  std::thread thread_;  ///< guarded by `starts_`
  std::atomic<std::thread::id> servo_{};
  std::atomic<bool> runs_{false}, ends_{false};
  std::atomic<std::int64_t> tick_began_ns_{0};

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Entry> entries_;  ///< by falling priority
  std::vector<Ulong> due_;      ///< in the current tick
  Ulong next_handle_ = 1;
  Ulong running_ = 0;  ///< handle of the callback that runs now
};

}  // namespace kerf::hd
