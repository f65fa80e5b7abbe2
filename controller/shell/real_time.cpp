// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/real_time.hpp"

#include <array>
#include <cerrno>
#include <cstring>

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

namespace kerf {
namespace {

/// The servo's frames stay far below this; 256 KiB of the stack are touched in advance.
void touch_stack() noexcept {
  std::array<volatile std::uint8_t, 256 * 1024> frame;
  for (std::size_t i = 0; i < frame.size(); i += 1024) frame[i] = 0;
}

}  // namespace

std::vector<MissingRight> lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return {{std::string("locked memory (") + std::strerror(errno) +
               "; raise RLIMIT_MEMLOCK or grant CAP_IPC_LOCK)",
           "page faults may delay a tick by milliseconds"}};
}

std::vector<MissingRight> become_real_time(const RealTimeOptions& options) {
  std::vector<MissingRight> missing;
  const long cores = sysconf(_SC_NPROCESSORS_ONLN);
  const int cpu = options.cpu >= 0 ? options.cpu : static_cast<int>(cores) - 1;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (cpu < CPU_SETSIZE) CPU_SET(static_cast<std::size_t>(cpu), &set);
  if (const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set); error != 0) {
    missing.push_back({"core " + std::to_string(cpu) + " (" + std::strerror(error) + ")",
                       "the servo may move between cores"});
  }
  sched_param parameters{};
  parameters.sched_priority = options.priority;
  if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
      error != 0) {
    missing.push_back({"SCHED_FIFO " + std::to_string(options.priority) + " (" +
                           std::strerror(error) + "; raise RLIMIT_RTPRIO or grant CAP_SYS_NICE)",
                       "other programs may delay ticks by tens of milliseconds"});
  }
  touch_stack();
  return missing;
}

ThreadFaults thread_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace kerf
