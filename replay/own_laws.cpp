// SPDX-License-Identifier: Apache-2.0
#include "replay/own_laws.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stop_token>
#include <string>

#include <pthread.h>

#include "controller/run/law_trial.hpp"
#include "shared/posix/threads.hpp"
#include "shared/text/text.hpp"

namespace kerf {

RecordedRun load_tried_run(const ReplayOptions& options, bool with_segment) {
  RecordedRun run =
      load_run(options.folder, options.changes, kernels_named(options.kernels), with_segment);
  for (const std::string& line : try_own_laws(run.scene)) {
    std::fprintf(stderr, "kerf-replay: warning: %s\n", escaped(line).c_str());
  }
  return run;
}

StepGuard::StepGuard(const RecordedRun& run)
    : thread_([watchdog =
                   StepWatchdog(pthread_self(), *run.steps)](const std::stop_token& stop) mutable {
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

}  // namespace kerf
