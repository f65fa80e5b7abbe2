// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The grid of a sweep: its axes, the runs that they give, and the table of their rows on the disk.
namespace kerf::sweep {

/// The values of one key of a sweep, in order.
struct Axis {
  std::string key;  ///< of a scene, `table.key`; or `emulator.OPTION`
  std::vector<std::string> values;

  [[nodiscard]] bool of_emulator() const { return key.starts_with("emulator."); }
};

inline constexpr std::size_t kMostRuns = 1'000'000;

/// `KEY=LO:HI:N` (N values from LO to HI, both included), `KEY=A,B,C` or `KEY=A`. Commas in
/// brackets belong to a value. Throws `HilError` for another form, an empty range or list, or a key
/// that no scene has; the scene checks the values.
[[nodiscard]] Axis parse_axis(std::string_view text);

/// All axes; throws `HilError` if a key stands twice or there are more than `kMostRuns` runs.
[[nodiscard]] std::vector<Axis> parse_axes(std::span<const std::string> texts);

[[nodiscard]] std::size_t runs_of(std::span<const Axis> axes);
/// The value of each axis in run `run`; the last axis changes fastest.
[[nodiscard]] std::vector<std::string> values_of(std::span<const Axis> axes, std::size_t run);

inline constexpr const char* kTableName = "sweep.csv";
inline constexpr const char* kPartName = "sweep.part";

/// The table of a sweep while it grows: rows in the order in which runs end, in `sweep.part`, on
/// the disk at once; at the end in the order of the runs, as `sweep.csv`.
///
/// `plan` is one line that identifies the sweep; a part of another plan is refused, one of the same
/// plan is continued. A row that was cut is run again. One sweep at a time: the file is
/// locked. Throws `HilError`.
class Table {
 public:
  Table(std::filesystem::path folder, const std::string& plan);
  ~Table();
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  [[nodiscard]] bool has(std::size_t run) const { return rows_.contains(run); }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  /// Rows whose last cell, the message, is not empty.
  [[nodiscard]] std::size_t failed() const;
  /// `row` without its end of line and without the number of the run.
  void add(std::size_t run, const std::string& row);
  /// Writes `sweep.csv` and removes the part.
  void finish(const std::string& head);

 private:
  [[noreturn]] void fail(const char* what);

  std::filesystem::path folder_, part_;
  int fd_ = -1;
  std::map<std::size_t, std::string> rows_;
};

}  // namespace kerf::sweep
