// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "shared/numeric/histogram.hpp"

namespace kerf {

/// A device that a kernel drives through one descriptor: requests come, answers and what the device
/// says by itself go. One thread.
class KernelDevice {
 public:
  virtual ~KernelDevice() = default;
  /// Readable when the kernel asks; negative while the device is unplugged.
  [[nodiscard]] virtual int descriptor() const noexcept = 0;
  /// Takes what waits there, without waiting for more.
  virtual void answer() = 0;
  /// When `wake` is due although nobody asks, CLOCK_MONOTONIC ns.
  [[nodiscard]] virtual std::int64_t next_wake_ns() const noexcept = 0;
  virtual void wake() = 0;
};

/// Serves while `goes_on`, which is asked between two steps and at least every 100 ms. `lateness`
/// records how late `wake` was called.
void serve_kernel(KernelDevice& device, const std::function<bool()>& goes_on, Histogram& lateness);

}  // namespace kerf
