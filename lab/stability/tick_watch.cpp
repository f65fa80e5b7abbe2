// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/tick_watch.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <pthread.h>

#include "shared/posix/program.hpp"

namespace kerf::zwidth {

TickWatch::TickWatch(std::mutex& results)
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

void TickWatch::look() {
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

TickWatch::Watched::Watched(TickWatch& watch, const StepCounter& ticks, std::string what)
    : watch_(watch) {
  const std::scoped_lock hold(watch.lock_);
  place_ = watch.measured_.insert(watch.measured_.end(),
                                  {StepWatchdog(pthread_self(), ticks.ticks()), std::move(what)});
}

TickWatch::Watched::~Watched() {
  const std::scoped_lock hold(watch_.lock_);
  watch_.measured_.erase(place_);
}

}  // namespace kerf::zwidth
