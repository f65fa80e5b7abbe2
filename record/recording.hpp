// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "record/manifest.hpp"
#include "record/tick_log.hpp"
#include "shared/segment/reader.hpp"

// A recording as its readers use it: summary, CSV.

namespace kerf {

/// Makes the folder of a new recording. Throws `RecordError`.
void make_recording_folder(const std::filesystem::path& folder);

/// `run_program` of a program that reads recordings: one that is damaged ends it with exit code 1.
[[nodiscard]] int run_on_recordings(const char* program, const std::function<int()>& work);

/// Sums up rows that come in order.
class SummaryBuilder {
 public:
  SummaryBuilder(std::uint32_t tick_ns, std::vector<double> voxel_mm3);
  explicit SummaryBuilder(const SegmentInfo& info);
  void add(const TickRecord& record);
  [[nodiscard]] std::uint64_t rows() const noexcept { return out_.rows; }
  [[nodiscard]] RecordSummary result(const RecordLosses& losses, std::string_view end_reason) const;

 private:
  RecordSummary out_;
  std::uint32_t tick_ns_;
  std::vector<double> voxel_mm3_;
  std::uint64_t first_index_ = 0, next_index_ = 0;
  std::uint32_t fault_ = 0;
  std::uint64_t stale_in_a_row_ = 0;
};

/// Throws `RecordError`, one line, if the recording has no such arm.
void require_arm(const std::filesystem::path& folder, const Manifest& manifest, std::size_t arm);

/// Calls `visit` for each row of `range` in order, together with the second arm's row of the same
/// tick. The latter is null with one arm, and after the end of a truncated log. Throws
/// `RecordError`, also if the rows of both arms are not of one tick.
void for_each_tick(const std::filesystem::path& folder, const Manifest& manifest, TickRange range,
                   const std::function<void(const TickRecord&, const TickRecord*)>& visit);

/// The summary that the recorder wrote, without reading the rows; none if it wrote none, or if the
/// log has another number of rows. Throws `RecordError`.
[[nodiscard]] std::optional<RecordSummary> kept_summary(const std::filesystem::path& folder,
                                                        std::size_t arm = 0);

/// The summary as text in two columns.
[[nodiscard]] std::string to_text(const RecordSummary& summary);

/// The summary as JSON, and the date of the first row; empty: null.
[[nodiscard]] std::string to_json(const RecordSummary& summary, std::string_view date = {});

/// Writes the rows of an arm of the recording in `folder` as CSV, whole or not at all: one column
/// per number (`position_mm_0` ...), floats in the shortest form that reads back to the same bits.
/// Throws `RecordError`, or `FileError` if the file cannot be written.
void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv,
                TickRange range = {}, std::size_t arm = 0);

}  // namespace kerf
