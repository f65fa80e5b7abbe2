// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf {

/// Gives the calling thread SCHED_FIFO `priority` (0: leave it as it is) on core `cpu` (negative:
/// the last one, where the servo runs: a wake-up across cores costs far more than one on the same).
/// Returns what is missing and what it costs as one line, or nothing.
[[nodiscard]] std::string make_real_time(int priority, int cpu);

}  // namespace kerf
