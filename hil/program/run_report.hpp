// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hil/front/serving.hpp"
#include "hil/program/emulated_device.hpp"
#include "hil/program/emulator_options.hpp"

namespace kerf {

/// Throws FileError now where the report could not be written after the run, or would replace what
/// the run reads.
void check_report(const EmulatorOptions& options);

/// Writes what a run has shown as JSON: under another name first, then renamed, so the file is
/// whole or absent. Times in s from the first client on, device time. Counts are those of all
/// clients together, the device's state at the end is the last one's. Throws FileError.
void write_run_report(const std::string& file, const EmulatedDevice& device,
                      const FrontStats& front);

}  // namespace kerf
