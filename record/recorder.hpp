// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "record/tick_log.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/reader.hpp"

// The recorder: ring of ticks to log, and the run of kerf-recorder.

namespace kerf {

/// Ticks that were published and not recorded: the recorder stood still for longer than the ring.
struct RecordGap {
  std::uint64_t first_index = 0;
  std::uint64_t count = 0;
};

/// Copies the state ring into a tick log. Losses are counted.
class Recorder {
 public:
  /// Starts at the oldest record that the ring still has.
  Recorder(const SegmentReader& reader, TickLogWriter& log);

  /// Appends the records published since the last call; returns their number. A torn record is read
  /// again at the next call.
  std::uint64_t poll();

  /// After the end of the controller: `poll`; a record that is still torn is a gap.
  void drain();

  /// Published before the start and already overwritten then: no loss of this recorder.
  [[nodiscard]] std::uint64_t missed_before_start() const noexcept { return missed_before_start_; }
  /// At most `kMaxGaps`; `lost` counts on.
  [[nodiscard]] const std::vector<RecordGap>& gaps() const noexcept { return gaps_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Most waiting records of all polls.
  [[nodiscard]] std::uint64_t largest_lag() const noexcept { return largest_lag_; }

  static constexpr std::size_t kMaxGaps = 4096;

 private:
  void skip_to(std::uint64_t index);
  /// The first index that the ring has room for.
  [[nodiscard]] std::uint64_t oldest() const noexcept;

  const SegmentReader& reader_;
  TickLogWriter& log_;
  std::uint64_t next_ = 0;
  std::uint64_t missed_before_start_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t largest_lag_ = 0;
  std::vector<RecordGap> gaps_;
};

/// Options of kerf-recorder.
struct RecorderOptions {
  std::string name = kDefaultName;
  std::filesystem::path out;
  double wait_s = 10;  ///< for the controller to appear
  bool strict = false;
  std::filesystem::path report;  ///< may be empty
};

/// False if help or version was requested, and printed. Throws `UsageError`.
[[nodiscard]] bool parse_options(int argc, char** argv, RecorderOptions& options);

/// Records the controller `options.name` into the folder `options.out` until it ends or `stop`:
/// ticks.npy, scene.json, manifest.json. Returns the exit code: 0, or 1 under `strict` if ticks
/// were lost. Bad input and a full disk throw.
[[nodiscard]] int run_recorder(const RecorderOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf
