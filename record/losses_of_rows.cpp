// SPDX-License-Identifier: Apache-2.0
#include "record/losses_of_rows.hpp"

#include <algorithm>

#include "record/recorder.hpp"

namespace kerf {
namespace {

std::string text_of(const RecordGap& gap) {
  return std::to_string(gap.count) + " records from index " + std::to_string(gap.first_index);
}

}  // namespace

void LossesOfRows::add(const TickRecord& row) {
  const std::uint64_t index = record_index(row);
  begins_earlier_ = begins_earlier_ || index < next_;  // at the first row only
  if (index > next_) {
    gaps_.push_back({next_, index - next_});
    gap_rows_.push_back(rows_);
    lost_ += index - next_;
  }
  next_ = index + 1;
  ++rows_;
}

std::string LossesOfRows::why_not(const RecordLosses& said, bool is_final,
                                  std::uint64_t counted) const {
  if (begins_earlier_) {
    return "missed_before_start is " + std::to_string(said.missed_before_start) +
           ", and its first row is of an earlier record";
  }
  const auto holds = [](const RecordGap& hole, const RecordGap& gap) {
    return hole.first_index <= gap.first_index && gap.count <= hole.count &&
           gap.first_index - hole.first_index <= hole.count - gap.count;
  };
  std::uint64_t behind = 0;
  for (const RecordGap& gap : said.gaps) {
    if (gap.first_index >= next_) {
      behind += gap.count;
    } else if (std::ranges::none_of(gaps_, [&](const auto& hole) { return holds(hole, gap); })) {
      return "gaps has " + text_of(gap) + ", and some of them are in its rows";
    }
  }
  const bool may_lack = said.gaps.size() == Recorder::kMaxGaps;  // of those behind the last row
  const std::uint64_t lost = lost_ + behind;
  for (std::size_t i = 0; !is_final && !may_lack && i < gaps_.size() && gap_rows_[i] < counted;
       ++i) {
    std::uint64_t listed = 0;
    for (const RecordGap& gap : said.gaps) listed += holds(gaps_[i], gap) ? gap.count : 0;
    if (listed != gaps_[i].count) {
      return "gaps lacks " + text_of(gaps_[i]) + ", which are in no row";
    }
  }
  if (!is_final || said.lost == lost || (may_lack && said.lost > lost)) return {};
  return "lost_ticks is " + std::to_string(said.lost) + ", and " + std::to_string(lost) +
         " by its rows";
}

RecordLosses LossesOfRows::as_losses(std::size_t most_gaps) const {
  RecordLosses out{.missed_before_start = first_, .lost = lost_, .gaps = gaps_};
  if (out.gaps.size() > most_gaps) out.gaps.resize(most_gaps);
  return out;
}

}  // namespace kerf
