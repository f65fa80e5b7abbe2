// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

namespace kerf {

/// `kerf-lab`: measurements without a device. Returns the exit code: 0 fine, 2 bad input or set-up.
[[nodiscard]] int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace kerf
