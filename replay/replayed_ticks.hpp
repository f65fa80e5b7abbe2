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

/// The first field of a tick for which a replay computes another value.
struct DifferentTick {
  Tick tick = 0;
  std::size_t arm = 0;
  TickDifference at;
};

/// The first difference of the first arm that differs; empty if the records of all arms are equal.
[[nodiscard]] std::optional<DifferentTick> first_difference(const ArmRecords& recorded,
                                                            const ArmRecords& replayed,
                                                            std::size_t arms);

/// One line: "tick 1600 (1.600 s), contact: contact_force_n[1] was 0.531, is 0.527".
[[nodiscard]] std::string text_of(const DifferentTick& found, std::uint32_t tick_ns);

/// What a replay found.
struct ReplayResult {
  std::uint64_t ticks = 0;  ///< that were stepped
  Tick last_tick = 0;
  std::array<std::uint64_t, kMaxArms> output_hash{};  ///< after it
  std::optional<DifferentTick> difference;            ///< the first one
  std::string cut_short;  ///< why not all ticks were replayed; empty if they were
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
  /// Reads without an exception: on failure `rows` is empty, and it returns the line.
  [[nodiscard]] std::string try_read(std::uint64_t first, std::vector<ArmRecords>& rows);

  /// Why a replay that reached the last row is incomplete: the header counts more rows. Empty if it
  /// does not.
  [[nodiscard]] std::string cut_at_end() const;

 private:
  std::vector<TickLogReader> logs_;  ///< by arm
  std::vector<TickRecord> chunk_;
};

/// Why a replay ends after tick `last` if the next row is of a later tick, `next`.
[[nodiscard]] std::string gap_text(Tick last, Tick next);

/// Takes a recorded tick and the same one computed again; returns whether to go on.
using TickVisitor = std::function<bool(const ArmRecords& recorded, const ArmRecords& replayed)>;

/// Gives the servo the reports and commands of the log's ticks, in order, up to tick `until`,
/// and passes each tick to `visit`. It ends at a gap, because the servo's inputs there are unknown,
/// on `stop`, and at a row whose checksum is wrong. Throws `RecordError` if that is the first row.
/// After `step_earlier_ticks`.
[[nodiscard]] ReplayResult replay_ticks(RecordedRun& run, RecordedTicks& log, Tick until,
                                        const std::atomic<bool>& stop, const TickVisitor& visit);

}  // namespace kerf
