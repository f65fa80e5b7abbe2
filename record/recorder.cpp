// SPDX-License-Identifier: Apache-2.0
#include "record/recorder.hpp"

#include <algorithm>

namespace kerf {

Recorder::Recorder(const SegmentReader& reader, TickLogWriter& log) : reader_(reader), log_(log) {
  next_ = oldest();
  // Of another machine's run a segment may hold less than its ring could.
  TickRecord record;
  while (reader.state_at(next_, record) == ReadState::overrun) ++next_;
  missed_before_start_ = next_;
}

std::uint64_t Recorder::oldest() const noexcept {
  const std::uint64_t head = reader_.state_head();
  return head - std::min<std::uint64_t>(head, reader_.info().state_slots);
}

std::uint64_t Recorder::poll() {
  const std::uint64_t head = reader_.state_head();
  const std::uint64_t before = log_.rows();
  largest_lag_ = std::max(largest_lag_, head - std::min(next_, head));
  TickRecord record;
  while (next_ < head) {
    const ReadState state = reader_.state_at(next_, record);
    if (state == ReadState::busy || state == ReadState::not_yet) break;
    if (state == ReadState::ok) {
      log_.append(record);
      ++next_;
    } else {
      // The oldest record may be overwritten as we look: then the next round skips on.
      skip_to(std::max(next_ + 1, oldest()));
    }
  }
  log_.flush();
  return log_.rows() - before;
}

void Recorder::drain() {
  poll();
  for (const std::uint64_t head = reader_.state_head(); next_ < head; poll()) skip_to(next_ + 1);
}

void Recorder::skip_to(std::uint64_t index) {
  const std::uint64_t count = index - next_;
  lost_ += count;
  if (!gaps_.empty() && gaps_.back().first_index + gaps_.back().count == next_) {
    gaps_.back().count += count;
  } else if (gaps_.size() < kMaxGaps) {
    gaps_.push_back({next_, count});
  }
  next_ = index;
}

}  // namespace kerf
