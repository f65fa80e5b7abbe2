// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <iosfwd>

namespace kerf {

/// The whole of kerf-emulator, for `main` and for tests: parses, serves, reports. Ends early when
/// `stop` becomes true (within 100 ms). Exit code 0 = fine, 2 = bad input or set-up (one line on
/// `err`).
int run_emulator(int argc, const char* const* argv, const std::atomic<bool>& stop,
                 std::ostream& out, std::ostream& err);

}  // namespace kerf
