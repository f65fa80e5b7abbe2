// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "shared/segment/usual_name.hpp"

namespace kerf {

/// What the command line of kerf-recorder asks for.
struct RecorderOptions {
  std::string name = kUsualName;
  std::filesystem::path out;
  double wait_s = 10;  ///< for the controller to appear
  bool strict = false;
  std::filesystem::path report;  ///< empty: none
};

/// False where help or version was asked for, and shown. Throws `UsageError`.
[[nodiscard]] bool parse_options(int argc, char** argv, RecorderOptions& options);

/// Records the controller `options.name` into the folder `options.out` until it ends or `stop`:
/// ticks.npy, scene.json, manifest.json. Returns the exit code: 0, or 1 under `strict` where ticks
/// were lost. Bad input and a full disk throw.
[[nodiscard]] int run_recorder(const RecorderOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf
