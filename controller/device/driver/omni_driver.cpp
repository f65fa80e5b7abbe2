// SPDX-License-Identifier: Apache-2.0
#include "controller/device/driver/omni_driver.hpp"

#include <algorithm>
#include <cstdint>

#include "shared/wire/omni_packet.hpp"

namespace kerf {
namespace {

OmniCommand::Light light_of(Phase phase) noexcept {
  switch (phase) {
    case Phase::off:
    case Phase::calibrating:
      return OmniCommand::Light::slow_flash;
    case Phase::fault:
      return OmniCommand::Light::fast_flash;
    case Phase::armed:
    case Phase::ramping:
    case Phase::active:
      return OmniCommand::Light::steady;
  }
  return OmniCommand::Light::off;
}

}  // namespace

bool OmniDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = decode_report(packet);
  if (!said) return false;
  if (seen_) {
    // A counter that steps back or stands still is an old packet: keep the newer one.
    const std::uint32_t step = said->counter - report.counter;
    if (step == 0 || step > UINT32_MAX / 2) return false;
    lost_ += step - 1;
  }
  seen_ = true;
  report.encoder = said->encoder;
  report.wiper_a = said->pot_a;
  report.wiper_b = said->pot_b;
  report.button1 = said->button1;
  report.button2 = said->button2;
  report.parked = said->docked;
  report.counter = said->counter;
  return true;
}

std::size_t OmniDriver::compose(const ServoOutput& output, Packet& packet) noexcept {
  const auto bytes = encode(OmniCommand{.motor = output.motor_counts,
                                        .motors_on = output.motors_on,
                                        .light = light_of(output.phase)});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

std::size_t OmniDriver::compose_release(Packet& packet) const noexcept {
  const auto bytes = encode(OmniCommand{});
  std::ranges::copy(bytes, packet.begin());
  return bytes.size();
}

}  // namespace kerf
