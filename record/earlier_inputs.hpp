// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shared/segment/layout.hpp"

// What the servo was given before the first tick of a flight recording. A run is a function of its
// scene and these, so that the recording replays although it has only the last minute: from the
// run's first tick, by any build that computes the same bits.
//
//   inputs/000000000001.npy.gz   of the first arm, inputs-2/ of the second: rows of TickInputs,
//   65,536 in each file but the last; its name is
//                                the tick of the first row
//
// A tick is 60 bytes in memory and 3 to 8 in a file.

namespace kerf {

inline constexpr std::string_view kInputsName = "inputs";  ///< of the first arm
/// The folder of an arm's inputs.
[[nodiscard]] inline std::string_view inputs_name(std::size_t arm) noexcept {
  return arm == 0 ? kInputsName : "inputs-2";
}

/// The columns of a tick record that the servo reads.
struct TickInputs {
  std::int32_t raw[11];
  std::uint32_t stale;
  std::uint32_t command;
  std::uint32_t command_argument;
  std::uint32_t last_command;
};

static_assert(sizeof(TickInputs) == 60);

/// Collects the inputs of an arm of a run from its first tick on, for recordings of its end. Memory
/// for two files; each full one goes to the disk, in a thread beside the recorder, which must not
/// wait.
class EarlierInputs {
 public:
  static constexpr std::size_t kTicksAFile = std::size_t{1} << 16;

  /// Its files go into `folder`/inputs, or inputs-2.
  explicit EarlierInputs(std::filesystem::path folder, std::size_t arm = 0);

  /// The next tick. Never throws: after a missing tick, or a file that cannot be written, the
  /// inputs are not complete any more.
  void add(const TickRecord& record);

  /// Puts the inputs up to tick `last` into the recording in `folder`: full files as further names
  /// of the same file, or copies. Returns why that is not possible; empty: it is done. Throws
  /// FileError.
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

/// Calls `visit` for each tick from 1 to `last` in order, with the inputs of each of `arms` that
/// the recording in `folder` has; the other columns are 0. Throws `RecordError`, one line, for a
/// file that is missing or damaged: up to there `visit` was called.
void for_each_input(const std::filesystem::path& folder, Tick last, std::size_t arms,
                    const std::function<void(std::span<const TickRecord>)>& visit);

/// Copies the files with the inputs up to tick `last` from the recording in `from` to that in `to`,
/// which has none, of all arms that it has. Throws FileError and leaves nothing.
void copy_inputs(const std::filesystem::path& from, const std::filesystem::path& to, Tick last);

/// Gives the regular file `from` the further name `to`; copies it if the file system has no links.
/// Throws FileError.
void link_file(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace kerf
