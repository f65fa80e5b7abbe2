// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kerf::sweep {

/// One demo in lock-step, as `./kerf demo --virtual` runs it: kerf-controller and kerf-emulator,
/// two processes over a socket. So its bits are the demo's, and the end of a run ends no other.
struct CellJob {
  std::string scene;
  std::string device;                         ///< empty: one of the settings says it
  double seconds = 10;                        ///< of servo time in hand
  std::vector<std::string> settings;          ///< of the scene, KEY=VALUE
  std::vector<std::string> emulator_options;  ///< as its command line has them
  std::string name;                           ///< of the controller; no other may have it
};

/// What a run gave: a column of the table each, in the order of `result_columns`; numbers and
/// hashes of the programs' reports, empty if a run did not come to its report. Nothing in it
/// depends on time.
struct CellResult {
  int exit = 0;
  std::vector<std::string> values;
  std::string message;  ///< why it failed; empty: it did not
};

[[nodiscard]] const std::vector<std::string>& result_columns();

/// The one line with which the emulator refuses the options of `job`; empty: it takes them. Its
/// files go to `folder`, which exists.
[[nodiscard]] std::string emulator_refusal(const CellJob& job, const std::filesystem::path& folder,
                                           const std::atomic<bool>& stop);

/// Runs `job` with its files in `folder`, which exists. Empty if `stop` came between. Throws
/// `HilError` if the programs cannot be started.
[[nodiscard]] std::optional<CellResult> run_cell(const CellJob& job,
                                                 const std::filesystem::path& folder,
                                                 const std::atomic<bool>& stop);

}  // namespace kerf::sweep
