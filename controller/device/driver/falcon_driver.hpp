// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/device/driver/device_driver.hpp"

namespace kerf {

/// The Falcon: it answers each packet once, and says nothing of its own accord. Asks for homing
/// until all three axes are homed. The grip's centre button parks: held at rest it calibrates, let
/// go it starts the force. Lights: red in a fault, blue while the user is asked to do something
/// (home, park), green while parked or in force.
class FalconDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

  void start() noexcept override { static_cast<void>(release()); }

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  bool homed_ = false;
};

}  // namespace kerf
