// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kerf::sweep {

/// One demo in lock-step, as `./kerf demo --virtual` runs it: kerf-controller and kerf-emulator,
/// two processes over a socket. So its results are equal to the demo's to the bit, and a run that
/// ends or fails does not affect another one.
struct CellJob {
  std::string scene;
  std::string device;                         ///< empty: one of the settings says it
  double seconds = 10;                        ///< of servo time in hand
  std::vector<std::string> settings;          ///< of the scene, KEY=VALUE
  std::vector<std::string> emulator_options;  ///< as its command line has them
  std::string name;                           ///< of the controller; no other may have it
};

/// The results of a run, one for each column of the table, in the order of `result_columns`:
/// numbers and hashes from the programs' reports; empty if a run ended before its report. Nothing
/// in them depends on time.
struct CellResult {
  int exit = 0;
  std::vector<std::string> values;
  std::string message;  ///< why it failed; empty if it did not
};

[[nodiscard]] const std::vector<std::string>& result_columns();

/// The line with which the emulator refuses the options of `job`; empty if it accepts them. Its
/// files are written to `folder`, which exists.
[[nodiscard]] std::string emulator_refusal(const CellJob& job, const std::filesystem::path& folder,
                                           const std::atomic<bool>& stop);

/// Runs `job` with its files in `folder`, which exists. Empty if `stop` came between. Throws
/// `HilError` if the programs cannot be started.
[[nodiscard]] std::optional<CellResult> run_cell(const CellJob& job,
                                                 const std::filesystem::path& folder,
                                                 const std::atomic<bool>& stop);

}  // namespace kerf::sweep
