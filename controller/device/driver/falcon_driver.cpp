// SPDX-License-Identifier: Apache-2.0
#include "controller/device/driver/falcon_driver.hpp"

#include <algorithm>
#include <cstdint>

#include "shared/wire/falcon_packet.hpp"

namespace kerf {

bool FalconDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = falcon::decode_report(packet);
  if (!said) return false;
  homed_ = std::ranges::all_of(said->homed, [](bool homed) { return homed; });
  report.encoder = said->encoder;
  report.button1 = (said->buttons & falcon::kButtonForward) != 0;
  report.button2 = (said->buttons & falcon::kButtonPlus) != 0;
  report.parked = (said->buttons & falcon::kButtonCentre) != 0;
  report.homed = homed_;
  ++report.counter;
  return true;
}

std::size_t FalconDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  const bool asks = output.phase == Phase::off || output.phase == Phase::calibrating;
  const bool fault = output.phase == Phase::fault;
  const auto bytes = encode(FalconCommand{.motor = output.motor_counts,
                                          .homing = !homed_,
                                          .green = !asks && !fault,
                                          .blue = asks,
                                          .red = fault});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

std::size_t FalconDriver::compose_release(Packet& packet) const noexcept {
  const auto bytes = encode(FalconCommand{});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

}  // namespace kerf
