// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "hil/front/usb/usb_device.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf::test {

/// A device's clock that a host may hold: from then on it moves only as far as the host lets it. So
/// a machine that is busy, or slow under sanitizers, takes no time from either end, and what a test
/// says about milliseconds of a device holds on every machine. Any thread.
class HeldClock final : public UsbClock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override {
    const std::scoped_lock lock(mutex_);
    return present_ns();
  }
  [[nodiscard]] std::int64_t look_ns(std::int64_t ns) const noexcept override {
    const std::scoped_lock lock(mutex_);
    if (!held_ns_) return ns + behind_ns_;
    if (ns <= *held_ns_) return 0;
    reached_ns_ = held_ns_;
    return monotonic_ns() + kPollNs;
  }
  void hold() {
    const std::scoped_lock lock(mutex_);
    held_ns_ = present_ns();
  }
  /// Only while it is held: so much of the device's time, and returns when the device has come as
  /// far; after a second also without.
  void pass(std::int64_t ns) {
    {
      const std::scoped_lock lock(mutex_);
      *held_ns_ += ns;
    }
    const std::int64_t until_ns = monotonic_ns() + kNsPerSecond;
    while (!is_reached() && monotonic_ns() < until_ns) sleep_until_ns(monotonic_ns() + kPollNs / 2);
  }
  /// It goes on as the machine's clock does, from where it stands.
  void let_go() {
    const std::scoped_lock lock(mutex_);
    behind_ns_ = monotonic_ns() - present_ns();
    held_ns_.reset();
  }

 private:
  static constexpr std::int64_t kPollNs = 50'000;

  /// The device has asked for what is later.
  [[nodiscard]] bool is_reached() const {
    const std::scoped_lock lock(mutex_);
    return reached_ns_ == held_ns_;
  }
  [[nodiscard]] std::int64_t present_ns() const {
    return held_ns_ ? *held_ns_ : monotonic_ns() - behind_ns_;
  }

  mutable std::mutex mutex_;
  std::int64_t behind_ns_ = 0;  ///< the machine's clock
  std::optional<std::int64_t> held_ns_;
  mutable std::optional<std::int64_t> reached_ns_;  ///< by the device
};

}  // namespace kerf::test
