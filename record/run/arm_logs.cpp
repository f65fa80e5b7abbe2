// SPDX-License-Identifier: Apache-2.0
#include "record/run/arm_logs.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "record/losses_of_rows.hpp"
#include "record/recorder.hpp"
#include "record/tick_log.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// The losses before and between the first `rows` rows of a log.
RecordLosses losses_in(TickLogReader& log, std::uint64_t rows, std::uint64_t first) {
  LossesOfRows losses(first);
  std::vector<TickRecord> chunk(TickLogReader::kChunkRows);
  while (losses.rows() < rows) {
    const std::uint64_t left = std::min<std::uint64_t>(rows - losses.rows(), chunk.size());
    const std::size_t count = log.read(losses.rows(), std::span(chunk).first(left));
    for (const TickRecord& record : std::span(chunk).first(count)) losses.add(record);
  }
  return losses.as_losses(Recorder::kMaxGaps);
}

/// The beginning of the second arm's log: a recorder may have been killed between both files.
Beginning of_second(const std::filesystem::path& folder, Beginning begin) {
  const bool is_there = std::filesystem::exists(folder / tick_log_name(1));
  const bool goes_on = begin.file == TickLogWriter::Begin::after_last || begin.may_go_on;
  begin.file =
      is_there && goes_on ? TickLogWriter::Begin::after_last : TickLogWriter::Begin::new_file;
  return begin;
}

}  // namespace

Beginning beginning_in(const RecorderOptions& options, const SegmentReader& reader) {
  Beginning begin{.may_go_on = options.resume};
  if (!options.split.empty()) {
    begin.rows_a_part = static_cast<std::uint64_t>(
        std::llround(split_s(options.split) * 1e9 / reader.info().tick_ns));
  }
  if (!options.resume || !std::filesystem::exists(options.out / kTickLogName)) return begin;
  begin.file = TickLogWriter::Begin::after_last;
  // Killed between the file's first byte and its manifest: without rows.
  constexpr std::uintmax_t kOneRow = kTickLogHeaderBytes + sizeof(TickRecord);
  std::error_code none;
  const bool is_empty = std::filesystem::file_size(options.out / kTickLogName, none) < kOneRow;
  if (is_empty && !std::filesystem::exists(options.out / kManifestName)) return begin;
  const Manifest manifest = read_manifest(options.out);
  const std::string session = hex64(reader.info().session_id);
  if (manifest.session_id != session) {
    throw RecordError((options.out / kManifestName).string() + ": is of run " +
                      one_line(manifest.session_id) + ", and run " + session +
                      " goes on; choose another --out");
  }
  TickLogReader log(options.out / kTickLogName);
  begin.losses = manifest.losses;
  begin.next = manifest.losses.missed_before_start;
  begin.rows = log.rows();
  if (reader.info().arms > 1) {
    begin.rows = std::min(begin.rows, TickLogReader(options.out / tick_log_name(1)).rows());
  }
  if (begin.rows > 0) {
    TickRecord last;
    static_cast<void>(log.read(begin.rows - 1, std::span(&last, 1)));
    begin.next = index_of(last) + 1;
    // Killed between rows behind a gap and the manifest with the gap; or it has gaps behind the
    // last row, which are read again.
    if (*begin.next - begin.rows != begin.losses.missed_before_start + begin.losses.lost) {
      begin.losses = losses_in(log, begin.rows, begin.losses.missed_before_start);
    }
  }
  return begin;
}

ArmLogs::ArmLogs(const std::filesystem::path& folder, const Beginning& begin,
                 const SegmentInfo& info) {
  // The second arm first: if there is ticks.npy, there is ticks-2.npy.
  if (info.arms > 1) second_.emplace(folder / tick_log_name(1), of_second(folder, begin), info);
  first_.emplace(folder / tick_log_name(0), begin, info);
}

ArmSummaries ArmLogs::summaries(const RecordLosses& losses, std::string_view reason) const {
  ArmSummaries out{first_->summary.result(losses, reason)};
  if (second_) out.push_back(second_->summary.result(losses, reason));
  return out;
}

}  // namespace kerf
