// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "shared/segment/layout.hpp"
#include "web/tab_viewer.hpp"

namespace kerf::web {

/// Replays a recording in a browser's tab: publishes each tick to the page, and compares it with
/// the recorded one when it is reached for the first time. The comparison is that of kerf-replay.
/// The files of the recording are in a folder that the worker provides (web/page/log_files.js).
///
/// Construct it, then call `prepare` until it returns true. From then on call `step`, `go` and the
/// functions of TabViewer in any order; after `go`, `prepare` again. Only the constructor takes
/// long.
class TabReplay {
 public:
  /// Reads manifest and scene, loads and plans it: a second or two. Throws RecordError, LoadError
  /// or SegmentError, one line.
  explicit TabReplay(const std::filesystem::path& folder);
  ~TabReplay();
  TabReplay(const TabReplay&) = delete;
  TabReplay& operator=(const TabReplay&) = delete;

  /// Computes up to `ticks` ticks that are not shown: at first, in a flight recording, the ticks
  /// before its first one; later those on the way to the tick of `go`. Returns whether all are
  /// done. Throws RecordError for damaged inputs.
  [[nodiscard]] bool prepare(int ticks);

  /// Publishes up to `ticks` ticks and returns how many. Stops at the end of the recording, or
  /// after the first tick that differs. Call only after `prepare` has returned true.
  int step(int ticks);
  /// Whether the last `step` or `prepare` found the first difference, or `step` the end.
  [[nodiscard]] bool stopped() const noexcept;

  /// Continues at `tick`: the next calls of `prepare` compute the ticks on the way. Does nothing
  /// until `prepare` has returned true for the first time.
  void go(Tick tick);

  [[nodiscard]] TabViewer& viewer() noexcept;
  /// Call it instead of the viewer's `slot`. A slot without a step shows that the replay runs, too.
  void slot(bool ended);

  [[nodiscard]] int rate_hz() const noexcept;
  /// JSON: tick_ns, tick, first_tick, last_tick, earlier_tick (of those before the first one),
  /// goal (0: none), compared, difference (as kerf-replay prints it; null: none), cut_short (why
  /// the recording ends before it was recorded to its end; empty: it does not), output_hash,
  /// second_output_hash (of two arms). Cheap.
  [[nodiscard]] std::string facts() const;
  /// Hash of all volumes as kerf-replay prints it, 16 hex digits. Reads every voxel.
  [[nodiscard]] std::string volume_hash() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf::web
