// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/device/device_driver.hpp"

namespace kerf {

/// The Falcon: host and device take turns, one answer to each packet; only motors off does not wait
/// for its turn. Asks for homing until all
/// three axes are homed. The grip's centre button parks: held at rest it calibrates, let go it
/// starts the force. Lights: red in a fault, blue while the user is asked to do something (home,
/// park), green while parked or in force.
class FalconDriver final : public DeviceDriver {
 public:
  using DeviceDriver::DeviceDriver;

  void start() noexcept override;

 private:
  [[nodiscard]] bool take(std::span<const std::uint8_t> packet,
                          DeviceReport& report) noexcept override;
  [[nodiscard]] std::size_t compose(const ServoOutput& output, Packet& packet) noexcept override;
  [[nodiscard]] std::size_t compose_release(Packet& packet) const noexcept override;

  /// Ticks without an answer after which the turn counts as lost and is taken again.
  static constexpr int kPatienceTicks = 4;

  bool homed_ = false;
  bool forcing_ = false;                   ///< by the last packet
  int unanswered_ticks_ = kPatienceTicks;  ///< at the end of patience it is the host's turn
};

}  // namespace kerf
