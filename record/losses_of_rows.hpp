// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "record/manifest.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {

/// The ticks that were published but are in no row, by the rows themselves: what manifest.json says
/// of losses follows from them.
class LossesOfRows {
 public:
  /// `first`: index of the record at which the recorder began; 0 in a run recorded from its start.
  explicit LossesOfRows(std::uint64_t first) : first_(first), next_(first) {}

  /// The next row. Rows come in order (`why_out_of_order`).
  void add(const TickRecord& row);

  /// Why a manifest cannot say `said`; empty if it can. If `is_final`, all losses are in it, also
  /// those behind the last row. Else, of a recorder that was killed, those before row `counted`
  /// are: it writes them down before it counts the rows behind them in the header.
  [[nodiscard]] std::string why_not(const RecordLosses& said, bool is_final,
                                    std::uint64_t counted) const;

  /// Rows so far.
  [[nodiscard]] std::uint64_t rows() const noexcept { return rows_; }

  /// The losses for a manifest, with at most so many gaps.
  [[nodiscard]] RecordLosses as_losses(std::size_t most_gaps) const;

 private:
  std::uint64_t first_, next_;   ///< index of the first row, and of the next one
  bool begins_earlier_ = false;  ///< the first row is of a record before `first`
  std::uint64_t rows_ = 0, lost_ = 0;
  std::vector<RecordGap> gaps_;          ///< in order
  std::vector<std::uint64_t> gap_rows_;  ///< the row behind each
};

}  // namespace kerf
