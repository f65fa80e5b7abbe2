// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/watchdog.hpp"

#include <algorithm>

#include "shared/posix/cores.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

constexpr int kHighestPriority = 99;

}  // namespace

std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo) {
  const int core = core_of(servo);
  const int priority = std::min(servo.priority + 1, kHighestPriority);
  return std::jthread([&watchdog, core, priority](const std::stop_token& stop) {
    // Linux keeps a share of each core for ordinary threads (docs/devices.md): where another
    // program uses up the rest, all real-time threads of that core stand still together.
    static_cast<void>(leave_core(core));
    static_cast<void>(set_fifo(priority));
    while (!stop.stop_requested()) {
      watchdog.look(monotonic_ns());
      std::this_thread::sleep_for(kWatchdogPeriod);
    }
  });
}

}  // namespace kerf
