// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "hil/devmodel/hand_script.hpp"
#include "hil/script/fault_script.hpp"

namespace kerf::faults {

/// One emulated device, its driver and the servo step in virtual time, with faults between them.
struct Subject {
  const LoadedScene& scene;  ///< its device is the one that is emulated
  const HandScript& hand;
  double seconds = 4;
};

/// What a run has shown of the safety contract (docs/safety.md).
struct Outcome {
  std::vector<std::string> violations;  ///< the first few, with their times
  std::uint64_t violation_count = 0;
  std::uint64_t faults_begun = 0;
  double peak_n = 0;             ///< commanded
  double device_peak_n = 0;      ///< of the motors at the true tip
  double steepest_n_per_ms = 0;  ///< rise of the command
  double slowest_off_ms = 0;     ///< from the tick that switched the motors off to no torque
  std::string latched = "none";  ///< the first fault that the servo latched
  double latch_ms = 0;           ///< from the first fault of the script to that
  bool pushed = false;           ///< there was a force to go wrong
  bool pushed_again = false;     ///< and again after the last fault
};

/// Plays `script` on `subject`. The same arguments give the same outcome.
[[nodiscard]] Outcome run_faults(const Subject& subject, const FaultScript& script);

}  // namespace kerf::faults
