// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace kerf {

/// Runs `work` in a child process and waits for it, so that every end of the child has a line: a
/// library may reset the handler of a crash, overflow the stack of a thread of its own or call
/// _exit(), and no code of the child runs then.
///
/// The signals that ask for the end are passed on to the child. If this process is killed, the
/// child gets SIGTERM: it sets zero force and closes the device.
///
/// Returns the exit code: that of `work`, or 2 after one line on standard error, which begins with
/// `program`. Throws std::runtime_error if no process can be made. Main thread, before any other
/// thread is started.
[[nodiscard]] int run_guarded(const char* program, const std::function<int()>& work);

/// Marks the end of the child as one that has its line or needs none. Any thread, any signal
/// handler; no effect outside `run_guarded`.
void end_is_told() noexcept;

}  // namespace kerf
