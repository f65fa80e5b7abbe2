// SPDX-License-Identifier: Apache-2.0
#include "controller/device/omni_driver.hpp"

#include <array>
#include <span>

#include "shared/wire/omni_packet.hpp"

namespace kerf {
namespace {

OmniCommand::Light light_of(Phase phase) noexcept {
  switch (phase) {
    case Phase::calibrating:
      return OmniCommand::Light::slow_flash;
    case Phase::fault:
      return OmniCommand::Light::fast_flash;
    case Phase::docked:
    case Phase::ramping:
    case Phase::active:
      return OmniCommand::Light::steady;
  }
  return OmniCommand::Light::off;
}

}  // namespace

DeviceReport OmniDriver::read() noexcept {
  last_.fresh = false;
  // One byte more than a report: a longer packet shows by its size.
  std::array<std::uint8_t, omni::kReportBytes + 1> packet;
  for (int taken = 0; taken < kMaxDrain; ++taken) {
    const std::size_t size = port_.receive(packet);
    if (size == 0) break;
    const auto report =
        size <= packet.size() ? decode_report(std::span(packet).first(size)) : std::nullopt;
    if (!report) {
      ++refused_;
      continue;
    }
    if (seen_) {
      // A counter that steps back or stands still is an old packet: keep the newer one.
      const std::uint32_t step = report->counter - last_.counter;
      if (step == 0 || step > UINT32_MAX / 2) {
        ++refused_;
        continue;
      }
      lost_ += step - 1;
    }
    seen_ = true;
    last_ = {.fresh = true,
             .encoder = report->encoder,
             .wiper_a = report->pot_a,
             .wiper_b = report->pot_b,
             .button1 = report->button1,
             .button2 = report->button2,
             .docked = report->docked,
             .counter = report->counter};
  }
  return last_;
}

void OmniDriver::command(const ServoOutput& output) noexcept {
  const bool on = output.motors_on && !released_.load(std::memory_order_relaxed);
  const OmniCommand command{.motor = on ? output.motor_counts : std::array<std::int16_t, 3>{},
                            .motors_on = on,
                            .light = light_of(output.phase)};
  port_.send(encode(command));
}

bool OmniDriver::release() const noexcept {
  return port_.send(encode(OmniCommand{}));
}

}  // namespace kerf
