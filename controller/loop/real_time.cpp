// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/real_time.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include <sys/mman.h>
#include <sys/resource.h>

#include "shared/posix/threads.hpp"

namespace kerf {
namespace {

/// The servo's frames stay far below this; 256 KiB of the stack are touched in advance.
void touch_stack() noexcept {
  std::array<volatile std::uint8_t, 262144> frame;
  for (std::size_t i = 0; i < frame.size(); i += 1024) frame[i] = 0;
}

}  // namespace

std::vector<MissingRight> lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return {{std::string("locked memory (") + std::generic_category().message(errno) +
               "; raise RLIMIT_MEMLOCK or grant CAP_IPC_LOCK)",
           "page faults may delay a tick by milliseconds"}};
}

int core_of(const RealTimeOptions& options) {
  return options.cpu >= 0 ? options.cpu : allowed_cores().back();
}

IoThread io_thread_of(const RealTimeOptions& options) {
  constexpr int kHighestPriority = 99;
  return {.core = core_of(options), .priority = std::min(options.priority + 1, kHighestPriority)};
}

std::vector<MissingRight> become_real_time(const RealTimeOptions& options) {
  std::vector<MissingRight> missing;
  const int core = core_of(options);
  if (const int error = pin_to_core(core); error != 0) {
    missing.push_back(
        {"core " + std::to_string(core) + " (" + std::generic_category().message(error) + ")",
         "the servo may move between cores"});
  }
  if (const int error = set_fifo(options.priority); error != 0) {
    missing.push_back({"SCHED_FIFO " + std::to_string(options.priority) + " (" +
                           std::generic_category().message(error) +
                           "; raise RLIMIT_RTPRIO or grant CAP_SYS_NICE)",
                       "other programs may delay ticks by tens of milliseconds"});
  }
  touch_stack();
  return missing;
}

void unlock_memory() noexcept {
  munlockall();
}

ThreadFaults thread_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace kerf
