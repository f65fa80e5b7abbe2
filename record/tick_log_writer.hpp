// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "record/tick_log.hpp"
#include "shared/segment/layout.hpp"

// The tick log as a recorder writes it.

namespace kerf {

/// Receives the ticks of a run in order.
class TickSink {
 public:
  TickSink() = default;
  virtual ~TickSink() = default;
  TickSink(const TickSink&) = delete;
  TickSink& operator=(const TickSink&) = delete;
  /// The next tick of the first arm.
  virtual void append(const TickRecord& record) = 0;
  /// With two arms: the second arm's record, before `append` of the same tick. Ignored by default.
  virtual void append_second(const TickRecord& /*record*/) {}
  /// After the last of several.
  virtual void flush() {}
};

/// Writes one log. Not thread-safe. A failure throws `RecordError`; the file then has complete
/// rows.
class TickLogWriter final : public TickSink {
 public:
  enum class Begin {
    new_file,   ///< refuses a path that exists: a recording is never overwritten
    after_last  ///< appends after the complete rows of a log; removes an incomplete row or header
  };
  /// Refuses a log that another process writes. `after_last` keeps at most `most_rows` rows.
  /// `rows_a_part`: splits the log into files of as many rows.
  explicit TickLogWriter(std::filesystem::path path, Begin begin = Begin::new_file,
                         std::uint64_t most_rows = UINT64_MAX,
                         std::uint64_t rows_a_part = UINT64_MAX);
  ~TickLogWriter() override;

  /// Buffers a row; at most `kBufferRows` wait for `flush`.
  void append(const TickRecord& record) override;
  void flush() override;
  /// Rows to the disk, then the header that counts them, then the header to the disk.
  void sync();

  [[nodiscard]] std::uint64_t rows() const noexcept { return written_ + buffer_.size(); }
  /// Rows that are on the disk, and counted by the headers.
  [[nodiscard]] std::uint64_t synced() const noexcept { return synced_; }
  /// Files that have begun.
  [[nodiscard]] std::size_t parts() const noexcept { return part_; }

 private:
  [[noreturn]] void fail(int error);
  void write_header();
  /// Opens the files of a log to append behind its rows.
  void go_on(std::uint64_t most_rows);
  /// Ends the file that grows, and begins the next one.
  void begin_part();
  /// Rows of the file that grows, without those that wait.
  [[nodiscard]] std::uint64_t rows_of_part() const noexcept { return written_ - first_; }

  static constexpr std::size_t kBufferRows = 64;
  std::filesystem::path path_;
  std::uint64_t rows_a_part_;
  int lock_ = -1;            ///< the first file, as long as this lasts
  int fd_ = -1;              ///< the file that grows; perhaps the same
  std::size_t part_ = 1;     ///< which
  std::uint64_t first_ = 0;  ///< its first row
  std::uint64_t written_ = 0, synced_ = 0;
  std::vector<TickRecord> buffer_;
};

}  // namespace kerf
