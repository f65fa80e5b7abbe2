// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "record/manifest.hpp"
#include "record/tick_log_writer.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"

// The recorder: ring of ticks to log, and the run of kerf-recorder.

namespace kerf {

/// Copies the state ring, or those of both arms, into a log or into memory. If a record of one arm
/// is lost, the tick is a gap of both. Losses are counted.
class Recorder {
 public:
  /// Starts at the oldest record that the ring still has.
  Recorder(const SegmentReader& reader, TickSink& sink);

  /// Continues at record `next`, with the losses of the previous recorder. Records that are no
  /// longer in the ring are a gap.
  Recorder(const SegmentReader& reader, TickSink& sink, std::uint64_t next, RecordLosses losses);

  /// Appends the records published since the last call; returns their number. A torn record is read
  /// again at the next call.
  std::uint64_t poll();

  /// After the end of the controller: `poll`; a record that is still torn is a gap.
  void drain();

  /// Index of the record that is read next.
  [[nodiscard]] std::uint64_t next() const noexcept { return next_; }
  [[nodiscard]] const RecordLosses& losses() const noexcept { return losses_; }
  /// Largest number of records that waited at a poll.
  [[nodiscard]] std::uint64_t largest_lag() const noexcept { return largest_lag_; }

  static constexpr std::size_t kMaxGaps = 4096;

 private:
  /// Reads the records of index `next_` into `first_` and `second_`, for all arms or for none.
  [[nodiscard]] ReadState read_next() noexcept;
  void skip_to(std::uint64_t index);
  /// The first index that the ring has room for.
  [[nodiscard]] std::uint64_t oldest() const noexcept;

  const SegmentReader& reader_;
  TickSink& sink_;
  std::uint64_t next_ = 0;
  TickRecord first_{}, second_{};
  RecordLosses losses_;
  std::uint64_t largest_lag_ = 0;
};

inline constexpr std::chrono::milliseconds kPollPeriod{5};
inline constexpr double kMostFlightS = 3600;

/// Options of kerf-recorder.
struct RecorderOptions {
  std::string name = kDefaultName;
  std::filesystem::path out;
  double wait_s = 10;  ///< for the controller to appear
  bool strict = false;
  bool resume = false;  ///< continues the recording of the same run in `out`, if there is one
  std::string lead;     ///< FIFO of a controller in lock-step (--until), which then loses no tick
  double flight_s = 0;  ///< above 0: a flight recorder of as many seconds
  std::string split;    ///< run time of each file of the log, as "10m"; empty: one file
  std::filesystem::path report;  ///< may be empty
};

/// Seconds of a text as "90s", "10m" or "2h", from 1 s to 24 h. Throws `UsageError`.
[[nodiscard]] double split_s(const std::string& text);

/// False if help or version was requested, and printed. Throws `UsageError`.
[[nodiscard]] bool parse_options(int argc, char** argv, RecorderOptions& options);

/// Waits for controller `options.name` and connects. Throws `SegmentError` if none comes in time.
[[nodiscard]] SegmentConnection connect_within(const RecorderOptions& options,
                                               const std::atomic<bool>& stop);

/// Whether nothing more will be published.
[[nodiscard]] bool has_ended(const SegmentConnection& connection) noexcept;
/// The reason, as in manifest.json.
[[nodiscard]] std::string_view end_reason(const SegmentReader& reader, bool stopped) noexcept;

/// Records the controller `options.name` into the folder `options.out` until it ends or `stop`:
/// ticks.npy (ticks-2.npy of a second arm), clock.npy, scene.json, manifest.json. Returns the exit
/// code: 0, or 1 under `strict` if ticks were lost. Bad input and a full disk throw.
[[nodiscard]] int run_recorder(const RecorderOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf
