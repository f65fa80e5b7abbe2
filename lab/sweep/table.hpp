// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace kerf::sweep {

inline constexpr const char* kTableName = "sweep.csv";
inline constexpr const char* kPartName = "sweep.part";

/// The table of a sweep while it grows: rows in the order in which runs end, in `sweep.part`, on
/// the disk at once; at the end in the order of the runs, as `sweep.csv`.
///
/// `plan` is one line that says what the sweep is; a part of another plan is refused, one of the
/// same plan is gone on with. A row that was cut is run again. One sweep at a time: the file is
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
