// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <string>
#include <vector>

#include "record/input_rows.hpp"
#include "shared/segment/layout.hpp"

// Collects the inputs of the servo before a flight recording (record/input_rows.hpp).

namespace kerf {

/// Collects the inputs of an arm from the first tick of a run on, for recordings of its end. Holds
/// two files in memory. A thread writes each full one to the disk, because the recorder must not
/// wait.
class EarlierInputs {
 public:
  /// Its files go into `folder`/inputs, or inputs-2.
  explicit EarlierInputs(std::filesystem::path folder, std::size_t arm = 0);

  /// The next tick. Never throws: after a missing tick, or a file that cannot be written, the
  /// inputs are not complete any more.
  void add(const TickRecord& record);

  /// Puts the inputs up to tick `last` into the recording in `folder`; full files as hard links, or
  /// copies. Returns why that is not possible; empty if it is done. Throws FileError.
  [[nodiscard]] std::string keep(const std::filesystem::path& folder, Tick last);

 private:
  /// Waits for the thread.
  void finish_writing();

  std::filesystem::path folder_;
  std::size_t arm_;
  std::vector<TickInputs> rows_;  ///< of the file that grows
  Tick first_ = 1;                ///< of `rows_`
  std::string problem_;           ///< why ticks are missing
  std::future<void> writing_;     ///< of the file before; last, since it ends first
};

/// Copies the files with the inputs of all arms up to tick `last` from the recording in `from` to
/// that in `to`, which has none. If it fails, removes the copies and throws FileError.
void copy_inputs(const std::filesystem::path& from, const std::filesystem::path& to, Tick last);

/// Makes `to` a hard link to the regular file `from`, or a copy if that fails. Throws FileError.
void link_file(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace kerf
