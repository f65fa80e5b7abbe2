// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stop_token>
#include <thread>

#include <pthread.h>

#include "replay/recorded_run.hpp"
#include "shared/posix/threads.hpp"

namespace kerf {

/// While it lives, a thread of its own watches the steps of a run, which the thread that made it
/// takes. If a step does not end, as in a law that loops, the program ends with one line and exit
/// code 2: such a thread cannot be ended, and no stop signal reaches it.
class StepGuard {
 public:
  /// `run` outlives it.
  explicit StepGuard(const RecordedRun& run)
      : thread_([watchdog = StepWatchdog(pthread_self(), *run.steps)](
                    const std::stop_token& stop) mutable {
          std::mutex own;
          std::unique_lock wait(own);
          std::condition_variable_any ended;
          constexpr std::chrono::milliseconds kPeriod{200};
          while (!watchdog.look()) {
            ended.wait_for(wait, stop, kPeriod, [] { return false; });
            if (stop.stop_requested()) return;
          }
          std::fprintf(stderr,
                       "kerf-replay: a step did not end in %d s; give every loop of your law a "
                       "bound that does not depend on its input (the lab tries it: law NAME)\n",
                       StepWatchdog::kMostSeconds);
          std::_Exit(2);
        }) {}

 private:
  std::jthread thread_;
};

}  // namespace kerf
