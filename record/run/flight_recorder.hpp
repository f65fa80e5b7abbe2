// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "record/run/recorder_options.hpp"

// The flight recorder: the last ticks of a run in memory of constant size, kept on request.

namespace kerf {

/// Keeps the last `options.flight_s` of controller `options.name` in memory until it ends or
/// `stop`. On a fault, a mark, SIGUSR1 or an end of the run that was not requested, it writes them
/// as a recording to `options.out`/TICK-REASON, which appears only when it is complete. The
/// recording can be replayed if the flight recorder saw the run from its first tick: then it also
/// has the inputs before its window (earlier_inputs.hpp), which meanwhile are in
/// `options.out`/.run-NAME. At most `kMostKept` recordings. Throws for bad input. Reports a
/// recording that cannot be written, as on a full disk, in one line, and goes on. Returns the exit
/// code: 0, or 1 after that line again if there was such a recording.
[[nodiscard]] int run_flight_recorder(const RecorderOptions& options,
                                      const std::atomic<bool>& stop);

}  // namespace kerf
