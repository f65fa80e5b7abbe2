// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <pthread.h>
#include <sched.h>

// Cores and priority of threads, worker threads, a queue between two threads, and a watchdog for a
// step that never ends.

namespace kerf {

/// Cores that this process may use, in order; a container may hold fewer than the machine has. By
/// convention the servo and its device take the last one, the visualizer the others.
[[nodiscard]] inline std::vector<int> allowed_cores() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  std::vector<int> cores;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return {0};
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(static_cast<std::size_t>(core), &allowed)) cores.push_back(core);
  }
  return cores;
}

/// SCHED_FIFO `priority` for the calling thread. Returns 0 or the system's error number.
[[nodiscard]] inline int set_fifo(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
}

/// Keeps the calling thread on one core. Returns 0 or the system's error number.
[[nodiscard]] inline int pin_to_core(int core) noexcept {
  if (core < 0 || core >= CPU_SETSIZE) return EINVAL;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(core), &set);
  return pthread_setaffinity_np(pthread_self(), sizeof set, &set);
}

/// Keeps the calling thread on the other cores that it may use. Returns 0 or the system's error
/// number; if there is no other core, EINVAL, and the thread keeps its cores.
[[nodiscard]] inline int avoid_core(int core) noexcept {
  if (core < 0 || core >= CPU_SETSIZE) return EINVAL;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0) return errno;
  CPU_CLR(static_cast<std::size_t>(core), &set);
  return pthread_setaffinity_np(pthread_self(), sizeof set, &set);  // refuses an empty set
}

/// Runs `work` in a thread of its own. If the system has no thread left, runs it here at once and
/// returns an empty thread.
template <class Work>
[[nodiscard]] std::jthread start_worker(const Work& work) {
  try {
    return std::jthread(work);
  } catch (const std::system_error&) {
    work();
    return {};
  }
}

/// A queue of `N` items between one thread that pushes and one that takes. Wait-free on both sides;
/// a full queue refuses.
template <class T, std::uint32_t N>
class SpscQueue {
  static_assert(std::has_single_bit(N));

 public:
  [[nodiscard]] bool push(const T& item) noexcept {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == N) return false;
    items_[tail & (N - 1)] = item;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  [[nodiscard]] std::optional<T> take() noexcept {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return std::nullopt;
    const T item = items_[head & (N - 1)];
    head_.store(head + 1, std::memory_order_release);
    return item;
  }

  /// Any thread.
  [[nodiscard]] bool empty() const noexcept {
    return head_.load(std::memory_order_acquire) == tail_.load(std::memory_order_acquire);
  }

 private:
  // Both counters wrap; their difference is the fill. Each has its own cache line, so that the line
  // of the taker changes only when it takes.
  alignas(64) std::atomic<std::uint32_t> head_{0};
  alignas(64) std::atomic<std::uint32_t> tail_{0};
  std::array<T, N> items_{};
};

/// Detects, from another thread, a step that does not end, as an endless loop in a law of the user.
/// It measures the CPU time of the watched thread, so neither waiting nor a busy machine counts.
/// Such a thread cannot be ended, only its program.
class StepWatchdog {
 public:
  static constexpr int kMostSeconds = 5;  ///< of CPU time for one step; the longest takes some ms

  /// Watches a living thread that counts its steps in `steps`.
  StepWatchdog(pthread_t thread, const std::atomic<std::uint64_t>& steps,
               int most_seconds = kMostSeconds) noexcept
      : steps_(steps), most_seconds_(most_seconds) {
    known_ = pthread_getcpuclockid(thread, &clock_) == 0;
  }

  /// Call now and then, from one thread. True if the current step exceeds its time; false if the
  /// thread has ended.
  [[nodiscard]] bool look() noexcept {
    timespec used{};
    if (!known_ || clock_gettime(clock_, &used) != 0) return false;
    const std::uint64_t steps = steps_.load(std::memory_order_relaxed);
    if (steps != last_steps_ || !looked_) {
      last_steps_ = steps;
      since_ = used.tv_sec;
      looked_ = true;
    }
    return used.tv_sec - since_ > most_seconds_;
  }

 private:
  const std::atomic<std::uint64_t>& steps_;
  int most_seconds_;
  clockid_t clock_{};
  bool known_ = false;
  bool looked_ = false;
  std::uint64_t last_steps_ = 0;
  std::time_t since_ = 0;
};

}  // namespace kerf
