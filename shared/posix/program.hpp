// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace kerf {

/// The stack that a program asks for. What was measured needs 96 KiB at most (a CT that is read in
/// the sandbox), and threads get as much as the first one; a law of the user's may need more.
inline constexpr unsigned long long kLeastStackBytes = 1 << 20;

/// What every `main` of kerf is: `work`, and around it
/// - no file or socket that it opens becomes its standard input, output or error
/// - files and sockets that it makes are 0600, folders 0700, whatever umask it was started with;
///   they may be of patients
/// - a file that `ulimit -f` does not let grow is an error of the write, not a signal
/// - a stack of less than kLeastStackBytes is refused: it would end in a crash
/// - what it throws is one line on standard error, after `program`, and exit code 2
/// - where its standard output could not be written, so are a line and 2 instead of 0.
/// Returns the exit code, else that of `work`.
[[nodiscard]] int run_program(const char* program, const std::function<int()>& work);

}  // namespace kerf
