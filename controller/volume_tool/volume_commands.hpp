// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

namespace kerf {

/// The program kerf-volume: info, import, crop, resample, phantom. Returns its exit code: 0, or 2
/// after one line on `err` for bad input. Never throws.
int run_volume_tool(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace kerf
