// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

#include "replay/recorded_run.hpp"
#include "shared/segment/layout.hpp"

// The program kerf-replay.

namespace kerf {

/// Options of kerf-replay.
struct ReplayOptions {
  std::filesystem::path folder;
  ReplayChanges changes;
  std::string kernels;           ///< empty: the fastest
  Tick from = 0;                 ///< the first tick that is compared
  Tick until = UINT64_MAX;       ///< the last one
  std::filesystem::path out;     ///< a recording of the replay; may be empty
  std::filesystem::path plot;    ///< SVG of both runs; may be empty
  std::filesystem::path report;  ///< JSON; may be empty
  std::string watch;             ///< shown as the controller of this name; may be empty
};

/// Replays the recording and prints the result. Returns the exit code: 0; 1 if a tick differs
/// although nothing was changed, if not all ticks were replayed, or if the recording contradicts
/// itself (check_recording). Throws for bad input, one line.
[[nodiscard]] int run_replay(const ReplayOptions& options, const std::atomic<bool>& stop);

/// `kerf-replay`: the whole program, for its main and for that of a project with laws of its own.
/// Returns the exit code: as `run_replay`, and 2 for bad input.
[[nodiscard]] int run_replay_program(int argc, char** argv);

}  // namespace kerf
