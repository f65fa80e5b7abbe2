// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kerf {

/// Thrown out of a cell that is no longer wanted, because its program was asked to end.
struct Interrupted {};

}  // namespace kerf

/// The axes of a grid with their syntax; its cells, measured on threads, and their rows in a file
/// that survives an interruption. No cell depends on another, so any number of threads gives the
/// same rows.
namespace kerf::grid {

/// LO:HI:N as written. The command that reads it decides which ranges are allowed, and how the
/// values between the ends are spaced and rounded.
struct Range {
  double lo, hi, count;
};
inline constexpr std::size_t kMostCells = 1'000'000;

/// Parts between the separators that stand in no brackets, braces or quotes; at least one.
[[nodiscard]] std::vector<std::string> split(std::string_view text, char separator);

/// Empty if the text is not three numbers.
[[nodiscard]] std::optional<Range> range_in(std::string_view text);

/// The values of one key of a sweep, in order.
struct Axis {
  std::string key;  ///< of a scene, `table.key`; or `emulator.OPTION`
  std::vector<std::string> values;

  [[nodiscard]] bool of_emulator() const { return key.starts_with("emulator."); }
};

/// `KEY=LO:HI:N` (N values from LO to HI, both included), `KEY=A,B,C` or `KEY=A`. Commas in
/// brackets belong to a value. Throws `HilError` for another form, an empty range or list, or a key
/// that no scene has; the scene checks the values.
[[nodiscard]] Axis parse_axis(std::string_view text);

/// All axes; throws `HilError` if a key stands twice or there are more than `kMostCells` cells.
[[nodiscard]] std::vector<Axis> parse_axes(std::span<const std::string> texts);

[[nodiscard]] std::size_t cells_of(std::span<const Axis> axes);
/// The value of each axis in this cell; the last axis changes fastest.
[[nodiscard]] std::vector<std::string> values_of(std::span<const Axis> axes, std::size_t cell);

/// `asked` threads; if 0, one for each core.
[[nodiscard]] std::size_t threads_for(int asked);

/// Measures cells on threads. The calling thread waits, and alone receives the signals that ask for
/// the end.
class Run {
 public:
  /// On at most `threads` threads. `asked_to_stop` is set from outside and outlives this object.
  explicit Run(std::size_t threads, const std::atomic<bool>* asked_to_stop = nullptr)
      : threads_(threads), asked_(asked_to_stop) {}

  /// `work(cell, thread)` for the cells 0 to `cells` - 1, started in this order, `thread` counts
  /// from 0; until all are done or `stop()` is set. `meanwhile` is called by the calling thread
  /// every 50 ms, with `results()` held. Once all threads have ended it throws the first exception
  /// of a cell; `Interrupted` only ends the thread that threw it.
  void all(std::size_t cells, const std::function<void(std::size_t cell, std::size_t thread)>& work,
           const std::function<void()>& meanwhile = {});

  /// Set if the end was asked for or a cell threw. Long cells read it and give up.
  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }
  /// To be held while a cell changes anything that the cells share, such as rows and files.
  [[nodiscard]] std::mutex& results() { return results_; }

 private:
  std::size_t threads_;
  const std::atomic<bool>* asked_;
  std::atomic<bool> stop_{false};
  std::mutex results_;
};

/// Texts of the messages about a part file.
struct PartWords {
  const char* option;      ///< of the command line that names the file
  const char* busy;        ///< if another run has locked it
  const char* not_opened;  ///< follows the reason of the system
  const char* not_written;
};

/// A text file that grows by whole lines, each on the disk before the next cell is reported.
/// Locked: one run at a time. Throws `HilError` "OPTION PATH: reason".
class PartFile {
 public:
  /// Opens the file, or makes it.
  PartFile(const PartWords& words, std::filesystem::path path);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string text() const;
  /// Removes a last line that is not whole: its run was killed while it wrote.
  void cut_to_whole_lines();
  /// `line` without its end of line.
  void add(const std::string& line);
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  PartWords words_;
  std::filesystem::path path_;
  int fd_ = -1;
};

inline constexpr const char* kTableName = "sweep.csv";
inline constexpr const char* kPartName = "sweep.part";

/// The rows of a sweep in a folder: in `sweep.part` in the order in which cells end, and at the end
/// in the order of the cells in `sweep.csv`. A row is opaque text.
///
/// `plan` is one line that identifies the sweep; a part of another plan is refused, one of the same
/// plan is continued. A row that was cut is measured again. Throws `HilError`.
class Table {
 public:
  Table(const std::filesystem::path& folder, const std::string& plan);

  [[nodiscard]] bool has(std::size_t cell) const { return rows_.contains(cell); }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  /// Rows whose last value, the message, is not empty.
  [[nodiscard]] std::size_t failed() const;
  /// `row` without its end of line and without the number of the cell.
  void add(std::size_t cell, const std::string& row);
  /// Writes `sweep.csv` and removes the part.
  void finish(const std::string& head);

 private:
  PartFile part_;
  std::map<std::size_t, std::string> rows_;
};

}  // namespace kerf::grid
