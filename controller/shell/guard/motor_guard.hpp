// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <csignal>
#include <cstddef>

#include "controller/device/driver/device_driver.hpp"

namespace kerf {

/// While one of these lives, signal handlers of its thread run on this stack; then on the former.
class HandlerStack {
 public:
  HandlerStack(std::byte* stack, std::size_t bytes) noexcept;
  ~HandlerStack();
  HandlerStack(const HandlerStack&) = delete;
  HandlerStack& operator=(const HandlerStack&) = delete;

 private:
  stack_t before_{};
};

/// Motors off on every way out while one of these lives: its own end (return or exception), the
/// signals that ask for the end, in their handler already, and those that end a program at once
/// (segmentation fault, stack overflow, abort, ...), after which the signal takes its usual course
/// (shared/posix/stop_signals.hpp has them all). SIGKILL cannot be caught: there the device must
/// notice.
///
/// One at a time per process; the servo thread calls `guard_stack` once.
class MotorGuard {
 public:
  explicit MotorGuard(DeviceDriver& device) noexcept;
  ~MotorGuard();
  MotorGuard(const MotorGuard&) = delete;
  MotorGuard& operator=(const MotorGuard&) = delete;

  /// Gives the calling thread a stack for the handlers, so that they run after a stack overflow
  /// too.
  [[nodiscard]] HandlerStack guard_stack() noexcept { return {stack_.data(), stack_.size()}; }

 private:
  static constexpr std::size_t kStackBytes = 65536;
  DeviceDriver& device_;
  alignas(16) std::array<std::byte, kStackBytes> stack_{};
};

}  // namespace kerf
