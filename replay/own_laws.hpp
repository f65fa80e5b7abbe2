// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

#include "replay/recorded_run.hpp"
#include "replay/replay.hpp"

// What a replay does against laws of the user that crash or do not end.

namespace kerf {

/// `load_run` for the program, and then the laws of a project in a process of their own, as before
/// a run (try_own_laws): one line on standard error for each that gives no number or allocates.
/// Throws std::runtime_error, one line, for one that crashes or does not end. One thread.
[[nodiscard]] RecordedRun load_tried_run(const ReplayOptions& options, bool with_segment = false);

/// While it lives, a thread of its own watches the steps of a run, which the thread that made it
/// takes. If a step does not end, as in a law that loops, the program ends with one line and exit
/// code 2: such a thread cannot be ended, and no stop signal reaches it.
class StepGuard {
 public:
  /// `run` outlives it.
  explicit StepGuard(const RecordedRun& run);

 private:
  std::jthread thread_;
};

}  // namespace kerf
