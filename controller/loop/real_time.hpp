// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/device/port/io_mailbox.hpp"

namespace kerf {

/// Real-time settings of the servo thread.
struct RealTimeOptions {
  int priority = 80;         ///< SCHED_FIFO
  int cpu = -1;              ///< core of the servo thread; -1: the last one
  std::int64_t spin_us = 0;  ///< spinning before each deadline
  bool strict = false;       ///< a missing right refuses instead of warning
};

/// The core that the servo thread takes.
[[nodiscard]] int core_of(const RealTimeOptions& options);

/// That core, and a priority above the servo's, for what must not wait for it.
[[nodiscard]] IoThread io_thread_of(const RealTimeOptions& options);

/// A right that the system did not grant, and the effect.
struct MissingRight {
  std::string what;
  std::string effect;
};

/// Locks all memory of the process, present and future. Main thread, before the servo thread
/// starts. Empty on success.
[[nodiscard]] std::vector<MissingRight> lock_memory();

/// Unlocks it again, so that later allocations need no locked memory.
void unlock_memory() noexcept;

/// Gives the calling thread its priority and its core, and touches its stack so that no page of it
/// faults later.
[[nodiscard]] std::vector<MissingRight> become_real_time(const RealTimeOptions& options);

/// Page faults of the calling thread since it began.
struct ThreadFaults {
  std::int64_t minor = 0, major = 0;
};
[[nodiscard]] ThreadFaults thread_faults() noexcept;

}  // namespace kerf
