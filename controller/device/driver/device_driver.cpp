// SPDX-License-Identifier: Apache-2.0
#include "controller/device/driver/device_driver.hpp"

#include "controller/device/driver/falcon_driver.hpp"
#include "controller/device/driver/omni_driver.hpp"
#include "controller/device/driver/wooden_driver.hpp"

namespace kerf {

DeviceReport DeviceDriver::read() noexcept {
  last_.fresh = false;
  std::array<std::uint8_t, kMaxPacketBytes + 1> packet;  // a longer packet shows by its size
  for (int taken = 0; taken < kMaxDrain; ++taken) {
    const std::size_t size = port_.receive(packet);
    if (size == 0) break;
    if (size <= kMaxPacketBytes && take(std::span(packet).first(size), last_)) {
      last_.fresh = true;
    } else {
      ++refused_;
    }
  }
  return last_;
}

void DeviceDriver::command(const ServoOutput& output) noexcept {
  ServoOutput allowed = output;
  if (released_.load(std::memory_order_relaxed)) allowed.motors_on = false;
  if (!allowed.motors_on) allowed.motor_counts = {};
  Packet packet;
  const std::size_t size = compose(allowed, packet);
  const bool lets_go = forcing_ && !allowed.motors_on;
  if (lets_go) {
    port_.send_now(std::span(packet).first(size));
  } else {
    port_.send(std::span(packet).first(size));
  }
  forcing_ = allowed.motors_on;
  if (forcing_ && released_.load()) release();  // meanwhile, by another thread
}

bool DeviceDriver::release() const noexcept {
  Packet packet;
  const std::size_t size = compose_release(packet);
  return port_.send_now(std::span(packet).first(size));
}

bool DeviceDriver::stay_released() noexcept {
  released_.store(true);
  return release();
}

bool DeviceDriver::release_for_good() noexcept {
  released_.store(true);
  Packet packet;
  const std::size_t size = compose_release(packet);
  return port_.send_last(std::span(packet).first(size));
}

std::unique_ptr<DeviceDriver> make_driver(
    Personality personality, PacketPort& port,
    const std::optional<std::array<double, 3>>& encoder_sign) {
  switch (personality) {
    case Personality::falcon:
      return std::make_unique<FalconDriver>(port);
    case Personality::woodenhaptics: {
      const auto sign = encoder_sign.value_or(std::array{1.0, 1.0, 1.0});
      return std::make_unique<WoodenDriver>(
          port, std::array{sign[0] < 0 ? -1 : 1, sign[1] < 0 ? -1 : 1, sign[2] < 0 ? -1 : 1});
    }
    case Personality::omni:
      break;
  }
  return std::make_unique<OmniDriver>(port);
}

}  // namespace kerf
