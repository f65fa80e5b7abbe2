// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/load/load_scene.hpp"
#include "controller/loop/real_time.hpp"
#include "shared/segment/command.hpp"

namespace kerf {

/// The command line of kerf-controller.
struct ControllerOptions {
  std::string scene;
  SceneOverrides overrides;
  std::vector<std::string> ports;  ///< as in open_port.hpp, one for each device of the scene
  std::optional<double> seconds;   ///< servo time after arming; none: until stopped
  double wait_s = 60;              ///< servo time until the user picks up the device
  std::string name = kDefaultName;
  bool virtual_time = false;
  std::vector<std::string> until;  ///< FIFOs with the tick up to which lock-step may go
  bool unchecked_gain = false;     ///< gains above the device's and beyond its stability
  bool check = false;
  bool explain = false;
  bool probe = false;
  bool guard = false;
  bool progress = false;
  RealTimeOptions real_time;
  std::string report;         ///< JSON, empty: none
  std::string final_volume;   ///< .nrrd of the first volume at the end, empty: none
  std::string emulator_args;  ///< file for the demo script, empty: none
};

/// Parses; prints help or version, or one line for an error, and then returns the exit code.
[[nodiscard]] std::optional<int> parse_options(int argc, const char* const* argv,
                                               ControllerOptions& options);

/// `kerf-controller`: the whole program, for its main and for that of a project with laws of its
/// own. Returns the exit code: 0 success, 1 a failed run, 2 bad input or set-up.
[[nodiscard]] int run_controller_program(int argc, char** argv);

}  // namespace kerf
