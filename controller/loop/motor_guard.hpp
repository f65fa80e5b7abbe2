// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <span>
#include <string>

#include "controller/device/devices.hpp"

// Motors off however a run ends, and the guard against system calls in the loop.

namespace kerf {

/// While one of these lives, signal handlers of its thread run on this stack; afterwards on the
/// former.
class HandlerStack {
 public:
  HandlerStack(std::byte* stack, std::size_t bytes) noexcept;
  ~HandlerStack();
  HandlerStack(const HandlerStack&) = delete;
  HandlerStack& operator=(const HandlerStack&) = delete;

 private:
  stack_t before_{};
};

/// Switches the motors of all devices off on every way out while one of these lives: at its own end
/// (return or exception), in the handler of signals that request the end, and on those that end a
/// program at once (segmentation fault, stack overflow, abort, ...), after which the signal takes
/// its usual course (shared/posix/stop_signals.hpp lists them). SIGKILL cannot be caught: then the
/// device must notice.
///
/// At most one per process; the servo thread calls `guard_stack` once.
class MotorGuard {
 public:
  explicit MotorGuard(const Devices& devices) noexcept;
  ~MotorGuard();
  MotorGuard(const MotorGuard&) = delete;
  MotorGuard& operator=(const MotorGuard&) = delete;

  /// Gives the calling thread a stack for the handlers, so that they run after a stack overflow
  /// too.
  [[nodiscard]] HandlerStack guard_stack() noexcept { return {stack_.data(), stack_.size()}; }

 private:
  static constexpr std::size_t kStackBytes = 65536;
  Devices devices_;
  alignas(16) std::array<std::byte, kStackBytes> stack_{};
};

/// `--guard`: the servo thread may make the system calls that its clock and its port need, and no
/// other. Any other (to map a page, to wait for a lock, to print a line) can cost a tick; it is
/// blocked, the motors go off at once, and the loop gets a stop request.
///
/// A seccomp filter of that thread alone. It cannot be removed, so calls at the end of a thread are
/// allowed as well. At most one per process, inside a MotorGuard, whose handler for SIGSYS it
/// replaces.
class CallGuard {
 public:
  /// `stop` ends the loop.
  CallGuard(const Devices& devices, std::atomic<bool>& stop) noexcept;
  ~CallGuard();
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

  /// Servo thread, before the loop. `ports` are those of `--port`, with `auto` resolved. Throws
  /// std::runtime_error with one line if the kernel has no such filter.
  void enter(std::span<const std::string> ports);
  /// Servo thread, after the loop: further calls that are not allowed fail without other effect.
  void leave() noexcept;

  /// Name of the first unexpected call; empty if there was none. Not for signal handlers.
  [[nodiscard]] std::string unexpected() const;

 private:
  Devices devices_;
};

}  // namespace kerf
