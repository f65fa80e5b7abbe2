// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hil/front/serving.hpp"
#include "hil/program/emulated_device.hpp"

namespace kerf {

/// Throws `HilError` now where the report could not be written after the run.
void check_report(const std::string& file);

/// Writes what a run has shown as JSON: under another name first, then renamed, so the file is
/// whole or absent. Times in s from the first client on, device time. Counts are those of all
/// clients together, the device's state at the end is the last one's. Throws `HilError`.
void write_run_report(const std::string& file, const EmulatedDevice& device,
                      const FrontStats& front);

}  // namespace kerf
