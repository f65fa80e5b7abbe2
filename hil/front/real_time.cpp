// SPDX-License-Identifier: Apache-2.0
#include "hil/front/real_time.hpp"

#include <system_error>

#include "shared/posix/cores.hpp"

namespace kerf {

std::string make_real_time(int priority, int cpu) {
  if (priority <= 0) return {};
  std::string missing;
  const int core = cpu >= 0 ? cpu : allowed_cores().back();
  if (pin_to_core(core) != 0) missing = "core " + std::to_string(core);
  if (const int error = set_fifo(priority); error != 0) {
    missing += (missing.empty() ? "" : " and ") + ("SCHED_FIFO " + std::to_string(priority)) +
               " (" + std::generic_category().message(error) + ")";
  }
  if (missing.empty()) return {};
  return "no right to " + missing + ": packets may be milliseconds late; run as root, set an " +
         "rtprio limit, or say --priority 0";
}

}  // namespace kerf
