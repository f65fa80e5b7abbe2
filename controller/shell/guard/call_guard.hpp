// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>
#include <string_view>

#include "controller/device/driver/device_driver.hpp"

namespace kerf {

/// `--guard`: the servo thread makes the system calls that its clock and its port need, and no
/// other. A further one (a page that is mapped, a lock that is waited for, a line that is printed)
/// can cost a tick; it does not run, the motors go off at once, and the loop is asked to stop.
///
/// A seccomp filter of that thread alone. It cannot be taken back, so what a thread does at its end
/// is allowed as well. One at a time per process, inside a MotorGuard, whose handler for SIGSYS it
/// replaces.
class CallGuard {
 public:
  /// `stop` is what ends the loop.
  CallGuard(DeviceDriver& device, std::atomic<bool>& stop) noexcept;
  ~CallGuard();
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

  /// Servo thread, before the loop. `port` as `--port` names it, `auto` resolved. Throws
  /// std::runtime_error with one line where the kernel has no such filter.
  void enter(std::string_view port);
  /// Servo thread, after the loop: further calls that are not allowed fail, and mean no harm.
  void leave() noexcept;

  /// Name of the first unexpected call; empty: there was none. Not a signal handler's.
  [[nodiscard]] std::string unexpected() const;
};

}  // namespace kerf
