// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace kerf {

/// From now on SIGINT, SIGTERM and SIGHUP only ask for an end in order, and the signals of writes
/// become errors. Returns what is true once an end was asked for. A SIGHUP that is ignored already
/// (nohup) stays so. Calls that a signal met are started again.
///
/// Main thread, once per process; stays for the rest of it.
std::atomic<bool>& catch_stop_signals() noexcept;

/// The same, and SIGTSTP, SIGTTIN and SIGTTOU ask for the end too: for a program that must not be
/// paused.
std::atomic<bool>& catch_stop_and_pause_signals() noexcept;

/// SIGPIPE and SIGXFSZ become errors of the write that met them: for a program that any other
/// signal may end at once.
void make_signals_of_writes_errors() noexcept;

/// Whether a signal asked for the end.
[[nodiscard]] bool stop_requested() noexcept;

}  // namespace kerf
