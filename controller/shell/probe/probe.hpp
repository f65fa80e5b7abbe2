// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/shell/controller_options.hpp"

namespace kerf {

/// `kerf-controller --probe`: the first look at a device, with its motors off throughout.
///
/// With a port: opens it, shows once a second (on a terminal: one line, ten times a second) what
/// the device says, until `seconds` or a signal; then tells what is missing and writes the report.
/// Without one: lists what is connected, and what this user and machine lack.
///
/// Exit code: 0 fine; 1 when a port was opened and no report came, or without one when the device
/// that --device names is not there. Throws std::exception with one
/// line where the port cannot be opened.
[[nodiscard]] int run_probe(const ControllerOptions& options);

}  // namespace kerf
