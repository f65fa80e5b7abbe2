// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/watchdog.hpp"

#include "shared/posix/cores.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {

std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo) {
  return std::jthread([&watchdog, above = io_thread_of(servo)](const std::stop_token& stop) {
    // Linux keeps a share of each core for ordinary threads (docs/devices.md): where another
    // program uses up the rest, all real-time threads of that core stand still together.
    static_cast<void>(leave_core(above.core));
    static_cast<void>(set_fifo(above.priority));
    while (!stop.stop_requested()) {
      watchdog.look(monotonic_ns());
      std::this_thread::sleep_for(kWatchdogPeriod);
    }
  });
}

}  // namespace kerf
