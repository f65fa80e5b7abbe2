// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "controller/device/omni_driver.hpp"

namespace kerf {

/// Motors off on every way out while one of these lives: its own end (return or exception), and the
/// signals that end a program at once (segmentation fault, abort, ...), after which the signal
/// takes its usual course. SIGINT, SIGTERM and SIGHUP only set `stop`, so that the loop ends in
/// order.
///
/// One at a time per process; main thread.
class MotorGuard {
 public:
  MotorGuard(const OmniDriver& device, std::atomic<bool>& stop) noexcept;
  ~MotorGuard();
  MotorGuard(const MotorGuard&) = delete;
  MotorGuard& operator=(const MotorGuard&) = delete;

 private:
  const OmniDriver& device_;
};

}  // namespace kerf
