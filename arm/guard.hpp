// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

namespace kerf {

/// Runs `work` in a child process and waits for it, so that every end of the child has a line: a
/// library may reset the handler of a crash, overflow the stack of a thread of its own or call
/// _exit(), and no code of the child runs then.
///
/// The guard owns the last message to a service (`leave_last_word`): it leaves when nothing of the
/// child can follow it. A library has none, as no call from another process reaches it.
///
/// The signals that ask for the end are passed on to the child. If this process is killed, the
/// child gets SIGTERM: it sets zero force and closes the device.
///
/// Returns the exit code: that of `work`, or 2 after one line on standard error, which begins with
/// `program`. Throws std::runtime_error if no process can be made. Main thread, before any other
/// thread is started.
[[nodiscard]] int run_guarded(const char* program, const std::function<int()>& work);

/// Leaves a connection's last message with the guard, which sends it if the child has ended,
/// however it has (SIGKILL too), and then ends its own hold on the connection. It takes the place
/// of the one before; nothing if `socket` is -1. At most 512 bytes. The thread of the frames; no
/// effect outside `run_guarded`.
void leave_last_word(int socket, std::string_view bytes) noexcept;

/// Marks the end of the child as one that has its line or needs none. Any thread, any signal
/// handler; no effect outside `run_guarded`.
void end_is_told() noexcept;

}  // namespace kerf
