// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/device/driver/device_driver.hpp"
#include "shared/wire/wooden_constants.hpp"

namespace kerf {

/// WoodenHaptics: a stream of HID reports that begins with the host's first one.
///
/// Calibration: the user holds the arm in its home pose and presses the button; the driver then
/// sets the device's encoders. The arm counts as parked from the button on until it leaves the
/// pose.
class WoodenDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

  void start() noexcept override { static_cast<void>(release()); }

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  std::size_t packet_bytes_ = wooden::kPacketBytes;  ///< then as long as the device's own
  bool button_ = false;                              ///< of the newest report
  std::array<std::int16_t, 6> counts_{};
  bool set_sent_ = false;  ///< encoders were set to home since the button was pressed
  bool homed_ = false;
  bool at_home_ = false;  ///< has not left the pose since
};

}  // namespace kerf
