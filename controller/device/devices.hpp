// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "controller/device/device_driver.hpp"
#include "controller/servo/servo.hpp"

namespace kerf {

/// The drivers of a scene's arms, in their order; the caller keeps them. Each is used as
/// DeviceDriver says: what switches motors off is for any thread and any signal handler.
class Devices {
 public:
  Devices(DeviceDriver& first) noexcept  // NOLINT(google-explicit-constructor): the usual case
      : drivers_{&first} {}
  /// `second` may be null: one arm.
  Devices(DeviceDriver& first, DeviceDriver* second) noexcept
      : drivers_{&first, second}, count_(second == nullptr ? 1 : 2) {}

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] DeviceDriver& operator[](std::size_t arm) const noexcept { return *drivers_[arm]; }

  // Of every device, though one may fail; false if one did.

  bool release() const noexcept {
    return each([](DeviceDriver& device) { return device.release(); });
  }
  bool stay_released() const noexcept {
    return each([](DeviceDriver& device) { return device.stay_released(); });
  }
  /// The port of one may take its time over the last packet: the motors of the other are off
  /// before.
  bool release_for_good() const noexcept {
    if (count_ > 1) static_cast<void>(stay_released());
    return each([](DeviceDriver& device) { return device.release_for_good(); });
  }

 private:
  template <class Action>
  bool each(Action action) const noexcept {
    bool all = true;
    for (std::size_t a = 0; a < count_; ++a) all = action(*drivers_[a]) && all;
    return all;
  }

  std::array<DeviceDriver*, kMaxArms> drivers_{};
  std::size_t count_ = 1;
};

}  // namespace kerf
