// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/volume/voxel_grid.hpp"

// The tick log: an NPY file of one row per tick.

namespace kerf {

/// A recording that cannot be written or read. One line: "location: value; remedy".
class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Files of a recording that are lost or damaged, or contradict each other: exit code 1 of a
/// program that reads recordings. Any other `RecordError` is bad input, 2.
class DamagedRecording : public RecordError {
 public:
  using RecordError::RecordError;
};

/// The log of a run: an NPY file of `TickRecord` rows behind a header of fixed size, so that it can
/// be extended and opens directly in NumPy (`np.load(path, mmap_mode="r")["position_mm"]`). A log
/// that was split goes on in further files of the same form, which sort behind it: ticks.npy,
/// ticks.npy.0002, ticks.npy.0003 and so on.
///
/// The column table is generated from `tick_table.hpp`. The row count in the header is updated at
/// every `sync`; later rows are complete, too, but after a power cut the last of them may be torn.
inline constexpr std::size_t kTickLogHeaderBytes = 4096;

/// The header of a log of `rows` rows: exactly `kTickLogHeaderBytes`.
[[nodiscard]] std::string tick_log_header(std::uint64_t rows);

/// File `part` of the log at `path`, from 1 on: the first is `path` itself.
[[nodiscard]] std::filesystem::path part_of_log(const std::filesystem::path& path,
                                                std::size_t part);

/// How many files the log at `path` has, without one behind a file that is missing.
[[nodiscard]] std::size_t files_of_log(const std::filesystem::path& path);

/// Whether `folder` is a recording, sound or not: one has a file ticks.npy.
[[nodiscard]] bool is_recording(const std::filesystem::path& folder);

/// The remedy if a file of the recording in `folder` is missing. If that is no recording but a
/// demo's folder, names the recording in its folder `log`.
[[nodiscard]] std::string way_to_recording(const std::filesystem::path& folder);

/// For what is wrong in `folder`: throws `DamagedRecording` if that is a recording, else
/// `RecordError`.
[[noreturn]] void refuse_recording(const std::filesystem::path& folder, const std::string& line);

/// Opens a file of a recording. Refuses the recording if the file is missing, for which `way` is
/// the remedy, or a folder, a pipe or a device, or larger than `most_bytes`. Without the right to
/// read it throws `RecordError`.
[[nodiscard]] std::ifstream open_recorded(const std::filesystem::path& path, const std::string& way,
                                          std::uintmax_t most_bytes = UINTMAX_MAX);

/// As "1 tick" and "2 ticks".
[[nodiscard]] inline std::string ticks_text(std::uint64_t count) {
  return std::to_string(count) + (count == 1 ? " tick" : " ticks");
}

/// Ticks of a log, both ends included.
struct TickRange {
  Tick from = 0;
  Tick until = UINT64_MAX;
  [[nodiscard]] bool is_whole() const noexcept { return from == 0 && until == UINT64_MAX; }
};

/// How many records were published before this one: of index i, `seq` is 2 i + 2.
[[nodiscard]] inline std::uint64_t index_of(const TickRecord& record) noexcept {
  return record_index(record);
}

/// Why `row` cannot be a row that was recorded: its checksum, or a `seq` that is not of its tick.
/// Empty if it can.
///
/// The checksum covers all bytes but those of `seq`. In a controller's run `seq` is twice `tick`. A
/// watched replay rests at some ticks, which have no record: there it is less.
[[nodiscard]] std::string why_unsound(const TickRecord& row);

/// Why `row` cannot follow `before`, if both are sound: rows that are doubled, exchanged or of
/// another run. Empty if it can: ticks may be lost between two rows, and a watched replay may rest.
[[nodiscard]] std::string why_out_of_order(const TickRecord& before, const TickRecord& row);

/// Reads one log, row by row, with constant memory; all its files as one.
class TickLogReader {
 public:
  /// One file of the log.
  struct Part {
    std::filesystem::path path;
    std::uint64_t first = 0;       ///< row
    std::uint64_t rows = 0;        ///< that are complete
    std::uint64_t counted = 0;     ///< rows by its header
    std::uint64_t bytes_left = 0;  ///< behind its last sound row, left out
  };

  static constexpr std::size_t kChunkRows = 1024;  ///< that `for_each` reads at a time

  /// Throws `RecordError` if a file has another layout, the first ends in its header, or one before
  /// the last is missing. A file that is truncated after the header, at any byte, has its complete
  /// rows. Of the rows beyond the count of the last file's header, those behind the last sound one
  /// are left out: a power cut leaves zeros, or half of what was written.
  explicit TickLogReader(std::filesystem::path path);

  /// Ends the log before row `rows`, although its files go on.
  void end_at(std::uint64_t rows);

  /// Rows to be read: the complete ones in the files, also those beyond the count of the header, up
  /// to `end_at`.
  [[nodiscard]] std::uint64_t rows() const noexcept { return rows_; }
  /// The complete ones in the files.
  [[nodiscard]] std::uint64_t rows_in_files() const noexcept {
    return parts_.back().first + parts_.back().rows;
  }
  /// Rows by the headers: more than `rows()` if a file was truncated.
  [[nodiscard]] std::uint64_t counted() const noexcept { return counted_; }
  [[nodiscard]] std::span<const Part> parts() const noexcept { return parts_; }

  /// Reads rows from `first` on into `rows`; returns how many there are, less at the end and before
  /// a row that is unsound or cannot follow the one before it. Throws `RecordError` if that is the
  /// first one.
  [[nodiscard]] std::size_t read(std::uint64_t first, std::span<TickRecord> rows);

  /// Reads without an exception: on failure returns 0 and sets `problem` to the line.
  [[nodiscard]] std::size_t read(std::uint64_t first, std::span<TickRecord> rows,
                                 std::string& problem);

  /// The first row of `tick` or a later one, by bisection; `rows()` if there is none. Checks no
  /// row; `read` checks the one found.
  [[nodiscard]] std::uint64_t row_of(Tick tick);

  /// Calls `visit` for each row of `range` in order. Throws as `read`.
  void for_each(const std::function<void(const TickRecord&)>& visit, TickRange range = {});

 private:
  /// Opens a file of the log, whose rows are then known. False, and it is none, if it ends in its
  /// header.
  [[nodiscard]] bool add_part(const std::filesystem::path& path);
  /// Ends the log behind the last row that is counted or sound.
  void leave_out_torn_rows();
  /// Reads rows as they are; false if a file cannot be read.
  [[nodiscard]] bool read_raw(std::uint64_t first, std::span<TickRecord> rows);

  std::filesystem::path path_;
  std::vector<Part> parts_;
  std::ifstream file_;
  std::size_t open_ = 0;  ///< which part `file_` is
  std::uint64_t rows_ = 0, counted_ = 0;
};

[[nodiscard]] inline double magnitude(const float (&vector)[3]) noexcept {
  return std::sqrt(double{vector[0]} * vector[0] + double{vector[1]} * vector[1] +
                   double{vector[2]} * vector[2]);
}

/// Density removed in one tick: its units over full density, times the voxel of the changed
/// volume (the first one, if a tick changed several). Negative for an undo.
[[nodiscard]] inline double removed_density_mm3(const TickRecord& record,
                                                std::span<const double> voxel_mm3) noexcept {
  if (record.removed == 0 || voxel_mm3.empty()) return 0;
  const auto changed = static_cast<std::size_t>(std::countr_zero(record.dirty_volumes));
  const double voxel = voxel_mm3[changed < voxel_mm3.size() ? changed : 0];
  const double mm3 = record.removed / kDensityMax * voxel;
  return (record.flags & kFlagUndo) != 0 ? -mm3 : mm3;
}

}  // namespace kerf
