// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "record/tick_log.hpp"
#include "shared/segment/reader.hpp"

namespace kerf {

/// Ticks that were published and not recorded: the recorder stood still for longer than the ring.
struct RecordGap {
  std::uint64_t first_index = 0;
  std::uint64_t count = 0;
};

/// Carries the state ring into a tick log. Loss is counted, never silent.
class Recorder {
 public:
  /// Starts at the oldest record that the ring still has.
  Recorder(const SegmentReader& reader, TickLogWriter& log);

  /// Appends what was published since the last call; returns how many records. A record that does
  /// not come whole is tried again at the next call.
  std::uint64_t poll();

  /// After the end of the controller: `poll`, and what still does not come whole is a gap.
  void drain();

  /// Published before the start and already overwritten then: no loss of this recorder.
  [[nodiscard]] std::uint64_t missed_before_start() const noexcept { return missed_before_start_; }
  /// At most `kMaxGaps`; `lost` counts on.
  [[nodiscard]] const std::vector<RecordGap>& gaps() const noexcept { return gaps_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Most records that ever waited for one poll.
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

}  // namespace kerf
