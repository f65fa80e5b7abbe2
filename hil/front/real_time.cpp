// SPDX-License-Identifier: Apache-2.0
#include "hil/front/real_time.hpp"

#include <cstring>

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

namespace kerf {

std::string make_real_time(int priority, int cpu) {
  if (priority <= 0) return {};
  std::string missing;
  cpu_set_t cores;
  CPU_ZERO(&cores);
  const long online = sysconf(_SC_NPROCESSORS_ONLN);
  CPU_SET(static_cast<std::size_t>(cpu >= 0 ? cpu : online - 1), &cores);
  if (sched_setaffinity(0, sizeof cores, &cores) != 0) {
    missing = "core " + std::to_string(cpu >= 0 ? cpu : online - 1);
  }
  sched_param param{};
  param.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
  if (error != 0) {
    missing += (missing.empty() ? "" : " and ") + ("SCHED_FIFO " + std::to_string(priority)) +
               " (" + std::strerror(error) + ")";
  }
  if (missing.empty()) return {};
  return "no right to " + missing + ": packets may be milliseconds late; run as root, set an " +
         "rtprio limit, or say --priority 0";
}

}  // namespace kerf
