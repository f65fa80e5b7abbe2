// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
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
  /// `encoder_sign`: 1 or -1 at each joint. Where it is -1, what the device counts falls as the
  /// joint turns in the sense of wooden_constants.hpp, and its motor turns the other way, too: the
  /// makers' branches differ so. Counts in reports and of motors are in the joints' sense.
  explicit WoodenDriver(PacketPort& port, std::array<int, 3> encoder_sign = {1, 1, 1}) noexcept
      : DeviceDriver(port), sign_(encoder_sign) {}

  void start() noexcept override { static_cast<void>(release()); }

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  using Counts = std::array<std::int16_t, 3>;
  /// From the device's sense to the joints', and back.
  [[nodiscard]] Counts turned(const Counts& counts) const noexcept;

  std::array<int, 3> sign_;
  /// Then as long as the device's own. The watchdog and signal handlers read it.
  std::atomic<std::size_t> packet_bytes_{wooden::kPacketBytes};
  bool button_ = false;                   ///< of the newest report
  std::array<std::int16_t, 6> counts_{};  ///< as they came
  Counts joints_{};                       ///< of a, b, c in the joints' sense
  bool set_sent_ = false;  ///< encoders were set to home since the button was pressed
  bool homed_ = false;
  bool at_home_ = false;  ///< has not left the pose since
};

}  // namespace kerf
