// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// `kerf-controller`: the whole program, for its main and for that of a project with laws of its
/// own. Returns the exit code: 0 success, 1 a failed run, 2 bad input or set-up.
[[nodiscard]] int run_controller_program(int argc, char** argv);

}  // namespace kerf
