// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/loop/publisher.hpp"
#include "replay/recorded_run.hpp"
#include "replay/replay_step.hpp"
#include "replay/replayed_ticks.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {

/// A recorded run that can go to any of its ticks, and publishes like a controller. To go back it
/// restores a snapshot of the servo and steps on from there. At most `kMostSnapshots` are in
/// memory, with at most `snapshot_bytes` in all, but always one.
///
/// Ticks of the recording go up and down, those of the segment only grow: they are equal until it
/// first goes back. One thread. Throws only if memory runs out.
class WatchedRun {
 public:
  static constexpr std::size_t kMostSnapshots = 32;

  struct Options {
    Tick until = UINT64_MAX;     ///< the last tick that is shown
    bool compares = false;       ///< with the recorded ticks
    std::size_t snapshot_bytes;  ///< see above
  };

  /// `run` has a segment, and its earlier ticks are stepped. Both outlive it.
  WatchedRun(RecordedRun& run, RecordedTicks& log, const Options& options);

  [[nodiscard]] Tick tick() const noexcept { return tick_; }
  /// The first tick of the log, and the last one that can be shown: an earlier one after a gap or a
  /// damaged row was found.
  [[nodiscard]] Tick first_tick() const noexcept { return before_log_ + 1; }
  [[nodiscard]] Tick last_tick() const noexcept { return last_tick_; }
  /// Why there is no tick after `last_tick`; empty if the recording ends there, or none was tried.
  [[nodiscard]] const std::string& cut_short() const noexcept { return cut_short_; }

  /// Steps and publishes the next tick. False at the end, or before a gap or a damaged row.
  bool step();

  /// Publishes an empty tick, as a sign of life for the readers.
  void rest();

  /// Goes to `tick`, or as near as the recording goes, in parts: after `begin_go`, call `go_on`
  /// until it returns true; then readers see the volumes of that tick. It steps at most `ticks`
  /// times.
  void begin_go(Tick tick);
  [[nodiscard]] bool go_on(int ticks);

  /// All ticks up to this one were compared. After the first difference none is compared any more.
  [[nodiscard]] Tick compared() const noexcept { return compared_; }
  [[nodiscard]] const std::optional<DifferentTick>& difference() const noexcept {
    return difference_;
  }
  /// Of the last step, by arm.
  [[nodiscard]] const std::array<ServoOutput, kMaxArms>& outputs() const noexcept {
    return outputs_;
  }

 private:
  /// The row of the next tick; null if there is none.
  [[nodiscard]] const ArmRecords* next_row();
  void end_here(std::string why);
  void step_servo(const ArmRecords& recorded);
  /// All bricks of all volumes, in as many ticks as that takes, without a record.
  void show_volumes();

  RecordedRun& run_;
  RecordedTicks& log_;
  Publisher publisher_;
  ReplayStep records_;
  std::vector<ArmRecords> rows_;
  std::uint64_t first_row_ = 0;
  Tick before_log_ = 0;  ///< the last tick before the log's first
  Tick tick_ = 0;        ///< of the recording
  Tick published_ = 0;   ///< of the segment
  Tick last_tick_ = 0;
  Tick goal_ = 0;  ///< of `begin_go`
  Tick compared_ = 0;
  bool compares_ = false;
  std::optional<DifferentTick> difference_;
  std::string cut_short_;
  std::array<ServoOutput, kMaxArms> outputs_{};
  Tick ticks_a_snapshot_ = 1;
  std::map<Tick, std::unique_ptr<ServoSnapshot>> snapshots_;  ///< by the last tick that was stepped
};

}  // namespace kerf
