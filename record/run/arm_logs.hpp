// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "record/manifest.hpp"
#include "record/recording.hpp"
#include "record/run/recorder_options.hpp"
#include "record/tick_log_writer.hpp"
#include "shared/segment/reader.hpp"

// The logs that a recorder writes, and where in them it begins.

namespace kerf {

/// What a recorder begins with: nothing, or the logs of the one before.
struct Beginning {
  TickLogWriter::Begin file = TickLogWriter::Begin::new_file;
  std::optional<std::uint64_t> next{};  ///< none: what the ring has
  RecordLosses losses{};
  std::uint64_t rows = 0;  ///< that the logs of all arms have; further ones are read again
  bool may_go_on = false;  ///< --resume
  std::uint64_t rows_a_part = UINT64_MAX;  ///< of each file of the log
};

/// Begins a new recording in `options.out`, or goes on (--resume) with the one that is there.
/// Throws if that is of another run, or cannot be read.
[[nodiscard]] Beginning beginning_in(const RecorderOptions& options, const SegmentReader& reader);

/// The log of one arm, summed up as it grows.
struct SummedLog {
  SummedLog(const std::filesystem::path& path, const Beginning& begin, const SegmentInfo& info)
      : file(path, begin.file, begin.rows, begin.rows_a_part), summary(info) {}
  void append(const TickRecord& record) {
    file.append(record);
    summary.add(record);
  }

  TickLogWriter file;
  SummaryBuilder summary;
};

/// The logs of a recorder. Of each tick the second arm's row is written first: whenever the
/// recorder is killed, each row of ticks.npy has its row in ticks-2.npy.
class ArmLogs final : public TickSink {
 public:
  ArmLogs(const std::filesystem::path& folder, const Beginning& begin, const SegmentInfo& info);
  void append_second(const TickRecord& record) override { second_->append(record); }
  void append(const TickRecord& record) override { first_->append(record); }
  void flush() override {
    if (second_) second_->file.flush();
    first_->file.flush();
  }
  void sync() {
    if (second_) second_->file.sync();
    first_->file.sync();
  }
  [[nodiscard]] std::uint64_t rows() const noexcept { return first_->file.rows(); }
  /// Rows that no power cut takes away any more.
  [[nodiscard]] std::uint64_t synced() const noexcept { return first_->file.synced(); }
  /// Files that each arm's log has begun.
  [[nodiscard]] std::size_t parts() const noexcept { return first_->file.parts(); }
  /// Of each arm.
  [[nodiscard]] ArmSummaries summaries(const RecordLosses& losses, std::string_view reason) const;

 private:
  std::optional<SummedLog> first_, second_;
};

}  // namespace kerf
