// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "shared/segment/command.hpp"

// The options of kerf-recorder.

namespace kerf {

inline constexpr double kMostFlightS = 3600;

/// Options of kerf-recorder.
struct RecorderOptions {
  std::string name = kDefaultName;
  std::filesystem::path out;
  double wait_s = 10;  ///< for the controller to appear
  bool strict = false;
  bool resume = false;  ///< continues the recording of the same run in `out`, if there is one
  std::string lead;     ///< FIFO of a controller in lock-step (--until), which then loses no tick
  double flight_s = 0;  ///< above 0: a flight recorder of as many seconds
  std::string split;    ///< run time of each file of the log, as "10m"; empty: one file
  std::filesystem::path report;  ///< may be empty
};

/// Seconds of a text as "90s", "10m" or "2h", from 1 s to 24 h. Throws `UsageError`.
[[nodiscard]] double split_s(const std::string& text);

/// False if help or version was requested, and printed. Throws `UsageError`.
[[nodiscard]] bool parse_options(int argc, char** argv, RecorderOptions& options);

}  // namespace kerf
