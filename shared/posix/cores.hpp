// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace kerf {

/// Cores that this process may use, in order; a container may hold fewer than the machine has. By
/// convention the servo and its device take the last one, the visualizer the others.
[[nodiscard]] std::vector<int> allowed_cores();

/// SCHED_FIFO `priority` for the calling thread. Returns 0 or the system's error number.
[[nodiscard]] int set_fifo(int priority) noexcept;

/// Keeps the calling thread on one core. Returns 0 or the system's error number.
[[nodiscard]] int pin_to_core(int core) noexcept;

/// Keeps the calling thread on the other cores that it may use. Returns 0 or the system's error
/// number; EINVAL, and the thread stays where it is, when there is no other.
[[nodiscard]] int leave_core(int core) noexcept;

}  // namespace kerf
