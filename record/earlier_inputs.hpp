// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "shared/segment/layout.hpp"

// What the servo was given before the first tick of a flight recording. A run is a function of its
// scene and these, so that the recording replays although it has only the last minute: from the
// run's first tick, by any build that computes the same bits.
//
//   inputs/000000000001.npy.gz   rows of TickInputs, 65,536 in each file but the last; its name is
//                                the tick of the first row
//
// A tick is 60 bytes in memory and 3 to 8 in a file.

namespace kerf {

inline constexpr std::string_view kInputsName = "inputs";

/// The columns of a tick record that the servo reads.
struct TickInputs {
  std::int32_t raw[11];
  std::uint32_t stale;
  std::uint32_t command;
  std::uint32_t command_argument;
  std::uint32_t last_command;
};

/// Collects the inputs of a run from its first tick on, for recordings of its end. Memory for one
/// file, allocated once; each full one goes to the disk.
class EarlierInputs {
 public:
  static constexpr std::size_t kTicksAFile = std::size_t{1} << 16;

  /// Its files go into `folder`/inputs.
  explicit EarlierInputs(std::filesystem::path folder);

  /// The next tick. Never throws: after a missing tick, or a file that cannot be written, the
  /// inputs are not complete any more.
  void add(const TickRecord& record);

  /// Empty: all ticks since the first are here. Else why not, for a line.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

  /// Puts the inputs up to tick `last` into the recording in `folder`: full files as further names
  /// of the same file, or copies. Only while there is no problem. Throws FileError.
  void keep(const std::filesystem::path& folder, Tick last) const;

 private:
  std::filesystem::path folder_;
  std::vector<TickInputs> rows_;  ///< of the file that grows
  Tick first_ = 1;                ///< of `rows_`
  std::string problem_;
};

/// Calls `visit` for each tick from 1 to `last` in order, with the inputs that the recording in
/// `folder` has; the other columns are 0. Throws `RecordError`, one line, for a file that is
/// missing or damaged: up to there `visit` was called.
void for_each_input(const std::filesystem::path& folder, Tick last,
                    const std::function<void(const TickRecord&)>& visit);

/// Gives the files in `from`, if there is such a folder, further names in the new folder `to`;
/// copies them if the file system has no links. Throws FileError.
void link_files(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace kerf
