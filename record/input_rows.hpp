// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shared/segment/layout.hpp"

// The inputs of the servo before the first tick of a flight recording. A run is a function of its
// scene and its inputs. So the recording can be replayed although it has only the last minute: from
// the run's first tick, by any build that computes the same bits.
//
//   inputs/000000000001.npy.gz   of the first arm, inputs-2/ of the second: rows of TickInputs, in
//                                each file but the last 65,536; the name is the first row's tick
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

/// Rows in each file but the last.
inline constexpr std::size_t kInputsAFile = std::size_t{1} << 16;

/// The file with the inputs of an arm from tick `first` on.
[[nodiscard]] std::filesystem::path inputs_file(const std::filesystem::path& folder,
                                                std::size_t arm, Tick first);
/// The header of a file of so many rows.
[[nodiscard]] std::string inputs_header(std::size_t rows);

/// Reads the inputs of the ticks from 1 to `last` in order. Memory for one file of each arm.
class InputReader {
 public:
  InputReader(std::filesystem::path folder, Tick last, std::size_t arms);

  /// The inputs of the next tick, of each arm; the other columns are 0. Empty after the last one.
  /// Throws `RecordError`, one line, for a file that is missing or damaged. Valid until the next
  /// call.
  [[nodiscard]] std::span<const TickRecord> next();

 private:
  void read_file();

  std::filesystem::path folder_;
  Tick last_;
  std::size_t arms_;
  Tick next_ = 1;
  std::array<std::vector<TickInputs>, kMaxArms> rows_;  ///< of the file with `next_`
  std::array<TickRecord, kMaxArms> tick_{};
};

}  // namespace kerf
