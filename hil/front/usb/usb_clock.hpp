// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "shared/posix/monotonic_clock.hpp"

namespace kerf {

/// What the time of an emulated USB device follows. Any thread.
class UsbClock {
 public:
  virtual ~UsbClock() = default;
  /// In ns; never goes back.
  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  /// When to look whether it is `ns` there, CLOCK_MONOTONIC.
  [[nodiscard]] virtual std::int64_t look_ns(std::int64_t ns) const noexcept = 0;
};

/// The machine's clock.
class MachineClock final : public UsbClock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return monotonic_ns(); }
  [[nodiscard]] std::int64_t look_ns(std::int64_t ns) const noexcept override { return ns; }
};
inline const MachineClock kMachineClock;

}  // namespace kerf
