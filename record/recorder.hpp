// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "record/manifest.hpp"
#include "record/tick_log_writer.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"

// How the programs of this folder follow a run: connection, ring of ticks to a log, end.

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

/// Waits for controller `name` and connects. Throws `SegmentError` if none comes within `wait_s` or
/// before `stop`.
[[nodiscard]] SegmentConnection connect_within(const std::string& name, double wait_s,
                                               const std::atomic<bool>& stop);

/// Whether nothing more will be published.
[[nodiscard]] bool has_ended(const SegmentConnection& connection) noexcept;
/// The reason, as in manifest.json.
[[nodiscard]] std::string_view end_reason(const SegmentReader& reader, bool stopped) noexcept;

}  // namespace kerf
