// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/shell/controller_options.hpp"

namespace kerf {

/// Runs the controller from the scene to the report and returns the exit code: 0 when all went
/// well, also where a signal ended it, even before there was a device; 1 when the device went, was
/// never docked or a fault latched. Throws std::exception with one line for bad input or set-up.
[[nodiscard]] int run_controller(const ControllerOptions& options);

}  // namespace kerf
