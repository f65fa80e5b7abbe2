// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/support/process.hpp"

namespace kerf::test {

/// Number of the kernel's tracepoint raw_syscalls:sys_enter; 0 where it cannot be read. Where no
/// tracefs is mounted, one is for a moment.
inline std::uint64_t tracepoint_of_calls() {
  const auto read = [](const std::filesystem::path& root) {
    std::uint64_t id = 0;
    std::ifstream(root / "events/raw_syscalls/sys_enter/id") >> id;
    return id;
  };
  for (const char* root : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
    if (const auto id = read(root)) return id;
  }
  const TemporaryFolder folder;
  if (mount("none", folder.path().c_str(), "tracefs", MS_RDONLY, nullptr) != 0) return 0;
  const auto id = read(folder.path());
  umount(folder.path().c_str());
  return id;
}

/// Counts the system calls of the thread that makes one of these, exactly.
class SystemCallCount {
 public:
  SystemCallCount() {
    perf_event_attr event{};
    event.size = sizeof event;
    event.type = PERF_TYPE_TRACEPOINT;
    event.config = tracepoint_of_calls();
    event.disabled = 1;
    if (event.config == 0) {
      why_not_ = "no tracefs";
      return;
    }
    fd_ = static_cast<int>(syscall(SYS_perf_event_open, &event, 0, -1, -1, 0));
    if (fd_ < 0) why_not_ = std::generic_category().message(errno);
  }
  ~SystemCallCount() {
    if (fd_ >= 0) close(fd_);
  }
  SystemCallCount(const SystemCallCount&) = delete;
  SystemCallCount& operator=(const SystemCallCount&) = delete;

  /// Empty where it counts.
  [[nodiscard]] const std::string& why_not() const { return why_not_; }
  void start() const { ioctl(fd_, PERF_EVENT_IOC_ENABLE, 0); }
  /// The calls since `start`, the one that stops it included.
  [[nodiscard]] std::uint64_t stop() const {
    ioctl(fd_, PERF_EVENT_IOC_DISABLE, 0);
    std::uint64_t count = 0;
    return ::read(fd_, &count, sizeof count) == sizeof count ? count : 0;
  }

 private:
  int fd_ = -1;
  std::string why_not_;
};

}  // namespace kerf::test
