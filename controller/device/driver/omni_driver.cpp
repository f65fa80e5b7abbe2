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

// Packets in 20 ms of an 8 kHz stream, after which the force is off whatever comes: a packet more
// costs nothing then.
constexpr std::uint32_t kNear = 160;
// In 2 s of it, after which the controller has given the device up: more cannot be missing.
constexpr std::uint32_t kMostMissing = 16'000;

}  // namespace

bool OmniDriver::is_newest(std::uint32_t counter) noexcept {
  const std::uint32_t step = counter - newest_;
  if (seen_) {
    if (step == 0 || 0U - step <= kNear) return false;
    if (step <= kNear) {
      lost_ += step - 1;
    } else {
      const bool goes_on = far_ && counter - *far_ - 1 < kNear;
      far_ = counter;
      if (!goes_on) return false;
      if (step <= kMostMissing) lost_ += step - 2;  // the refused one came
    }
  }
  far_.reset();
  seen_ = true;
  newest_ = counter;
  return true;
}

bool OmniDriver::take(std::span<const std::uint8_t> packet, DeviceReport& report) noexcept {
  const auto said = decode_report(packet);
  if (!said) return false;
  if (!is_newest(said->counter)) return false;
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
