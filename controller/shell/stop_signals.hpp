// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace kerf {

/// From its construction on, the signals by which people end or pause a program (SIGINT, SIGTERM,
/// SIGHUP, SIGTSTP, SIGTTIN, SIGTTOU) only ask for an end in order: a paused servo would leave the
/// motors at their last torque. SIGPIPE and SIGXFSZ become errors of the write that met them.
///
/// Main thread, once per process; stays for the rest of it.
[[nodiscard]] std::atomic<bool>& catch_stop_signals() noexcept;

}  // namespace kerf
