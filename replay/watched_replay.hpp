// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>

#include "replay/replay.hpp"
#include "replay/replayed_ticks.hpp"

// A recorded run, shown: in real time, slower, faster, tick by tick, from any tick on.

namespace kerf {

/// Publishes the replay of `log`, the recording in `options.folder`, as the controller
/// `options.watch`, from `options.from` to `options.until`, and until `stop` or key q. Readers see
/// it as a run: window, page, recorder.
///
/// Keys on standard input, a terminal or a pipe: space pauses and goes on, `.` steps one tick, `+`
/// and `-` double and halve the speed, `f` and `b` go a second forward and back, a number and `g`
/// go to that tick. A reader's `hold` pauses, its `reset` goes to the start, its `undo` and `redo`
/// go a second back and forward; so the keys of the window and the page's buttons do the same. They
/// are taken on the way to a tick, too, and count from that tick. See WatchedRun for how it goes
/// back. A speed that the machine does not reach is the highest that it reaches.
///
/// Returns 0; 1 if the recording lacks ticks, before which it stops. Throws as `run_replay`, and
/// SegmentError if a controller of that name runs.
[[nodiscard]] int watch_replay(const ReplayOptions& options, RecordedTicks& log,
                               const std::atomic<bool>& stop);

inline constexpr std::size_t kSnapshotBytes = std::size_t{512} << 20;  ///< of the whole replay

}  // namespace kerf
