// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "shared/segment/layout.hpp"
#include "web/tab_viewer.hpp"

namespace kerf::web {

/// A recording, replayed in the tab: each tick is compared, the first time that it is reached, with
/// the recorded one, as kerf-replay does, and published to the page. Its files are read as of any
/// folder; the worker has them (web/page/log_files.js).
///
/// The order: construct; then in turn `prepare` until it returns true, `step`, `go`, and the
/// messages of TabViewer. No call but the constructor takes long.
class TabReplay {
 public:
  /// Reads manifest and scene, loads and plans it: a second or two. Throws RecordError, LoadError
  /// or SegmentError, one line.
  explicit TabReplay(const std::filesystem::path& folder);
  ~TabReplay();
  TabReplay(const TabReplay&) = delete;
  TabReplay& operator=(const TabReplay&) = delete;

  /// At most `ticks` of those that come before a tick is shown: in a flight recording the ticks
  /// before its first one, later those on the way to the tick of `go`. Returns whether all are
  /// done. Throws RecordError for damaged inputs.
  [[nodiscard]] bool prepare(int ticks);

  /// Publishes up to `ticks` ticks and returns how many. Stops at the end of the recording, or
  /// after the first tick that differs. Call only after `prepare` has returned true.
  int step(int ticks);
  /// Whether the last `step` or `prepare` met the first difference, or `step` the end.
  [[nodiscard]] bool stopped() const noexcept;

  /// To that tick, by `prepare`. Before the first `prepare` is done it does nothing.
  void go(Tick tick);

  [[nodiscard]] TabViewer& viewer() noexcept;
  /// In place of the viewer's. A slot without a step is a sign of life, too.
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
