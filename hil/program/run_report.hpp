// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "hil/devmodel/emulator.hpp"
#include "hil/front/serving.hpp"

namespace kerf {

/// Throws `HilError` now where the report could not be written after the run.
void check_report(const std::string& file);

/// Writes what a run has shown as JSON: under another name first, then renamed, so the file is
/// whole or absent. Times in s from the first client on, device time. `withheld`: packets that
/// faults kept from the host. Throws `HilError`.
void write_run_report(const std::string& file, const Emulator& emulator, std::uint64_t withheld,
                      const FrontStats& front);

}  // namespace kerf
