// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "record/tick_log.hpp"
#include "replay/recorded_run.hpp"
#include "replay/replay_step.hpp"
#include "replay/tick_stages.hpp"
#include "shared/segment/layout.hpp"

// A recorded run, stepped again without device and clock.

namespace kerf {

/// What a replay found.
struct ReplayResult {
  std::uint64_t ticks = 0;  ///< that were stepped
  Tick last_tick = 0;
  std::array<std::uint64_t, kMaxArms> output_hash{};  ///< after it
  struct Found {
    Tick tick = 0;
    std::size_t arm = 0;
    TickDifference at;
  };
  std::optional<Found> difference;  ///< the first one
  std::string cut_short;            ///< why ticks of the recording are left; empty: none are
};

/// The logs of a recording, read side by side: ticks.npy, and ticks-2.npy of a second arm.
class RecordedTicks {
 public:
  /// Throws `RecordError`, as TickLogReader does; or if the log of the second arm has fewer rows.
  RecordedTicks(const std::filesystem::path& folder, std::size_t arms);

  [[nodiscard]] std::uint64_t rows() const noexcept { return logs_.front().rows(); }
  [[nodiscard]] std::uint64_t counted() const noexcept { return logs_.front().counted(); }
  /// Replaces `rows` by the next ones from `first` on, at most TickLogReader::kChunkRows; throws as
  /// TickLogReader::read, and for rows that are not of one tick.
  void read(std::uint64_t first, std::vector<ArmRecords>& rows);

 private:
  std::vector<TickLogReader> logs_;  ///< by arm
  std::vector<TickRecord> chunk_;
};

/// Takes a recorded tick and the same one computed again; returns whether to go on.
using TickVisitor = std::function<bool(const ArmRecords& recorded, const ArmRecords& replayed)>;

/// Gives the servo the reports and commands of the log's ticks, in order, up to tick `until`,
/// and hands each tick to `visit`. A gap ends it: what the servo was given there is unknown. So
/// do `stop` and a row whose checksum is wrong. Throws `RecordError` if that is the first one.
/// After `step_earlier_ticks`.
[[nodiscard]] ReplayResult replay_ticks(RecordedRun& run, RecordedTicks& log, Tick until,
                                        const std::atomic<bool>& stop, const TickVisitor& visit);

/// Options of kerf-replay.
struct ReplayOptions {
  std::filesystem::path folder;
  ReplayChanges changes;
  std::string kernels;           ///< empty: the fastest
  Tick from = 0;                 ///< the first tick that is compared
  Tick until = UINT64_MAX;       ///< the last one
  std::filesystem::path out;     ///< a recording of the replay; may be empty
  std::filesystem::path plot;    ///< SVG of both runs; may be empty
  std::filesystem::path report;  ///< JSON; may be empty
  std::string watch;             ///< shown as the controller of this name; may be empty
};

/// Replays the recording and prints what it found. Returns the exit code: 0; 1 if a tick differs
/// although nothing was changed, or if ticks are left. Bad input throws, one line.
[[nodiscard]] int run_replay(const ReplayOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf
