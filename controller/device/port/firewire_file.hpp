// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace kerf {

/// One open of a FireWire node (`/dev/fw*`): its ioctls and its events, linux/firewire-cdev.h.
///
/// Every open has its own events, and at most one isochronous context. Nothing here throws,
/// allocates or sleeps, except `open` and a `ready` that may wait.
class FirewireFile {
 public:
  FirewireFile() = default;
  ~FirewireFile();
  FirewireFile(const FirewireFile&) = delete;
  FirewireFile& operator=(const FirewireFile&) = delete;

  /// Opens `path` in place of what was open before, under the same descriptor, so that another
  /// thread never meets a closed or a foreign one. Returns 0 or an errno.
  [[nodiscard]] int open(const std::string& path) noexcept;

  /// Asks for the state of the bus, and from now on for its reset events; returns the generation,
  /// nothing when the device is gone.
  [[nodiscard]] std::optional<std::uint32_t> link() noexcept;

  /// What ioctl() returns, or a negative errno. Any thread, any signal handler.
  int call(unsigned long command, void* argument) noexcept;

  /// Whether an event waits, or comes within the time. Always asked before `read`, which would
  /// sleep: these nodes know no O_NONBLOCK.
  [[nodiscard]] bool ready(int milliseconds) noexcept;
  /// The oldest event into `buffer`; empty when the device is gone.
  [[nodiscard]] std::span<const std::uint8_t> read(std::span<std::uint8_t> buffer) noexcept;

  /// The device was unplugged: nothing will work any more.
  [[nodiscard]] bool gone() const noexcept { return gone_.load(std::memory_order_relaxed); }

 private:
  void note(int error) noexcept;

  int fd_ = -1;
  std::atomic<bool> gone_{false};  ///< written by whoever meets the end first
};

}  // namespace kerf
