// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>

#include "hil/device/emulator.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/personality.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::test {

/// Whether a packet of the host asks a device for torque; of the Omni, whether it leaves the motors
/// on.
inline bool asks_for_torque(Personality personality, std::span<const std::uint8_t> packet) {
  const auto any = [](const auto& motors) {
    return std::ranges::any_of(motors, [](auto count) { return count != 0; });
  };
  switch (personality) {
    case Personality::falcon: {
      const auto command = falcon::decode_command(packet);
      return command && any(command->motor);
    }
    case Personality::woodenhaptics: {
      const auto command = wooden::decode_command(packet);
      return command && any(command->milliamps);
    }
    case Personality::inverse3:
    case Personality::touch:
    case Personality::omega: {
      const auto command = decode_cartesian_command(packet);
      return command && (command->force_on || any(command->force_mn));
    }
    case Personality::omni:
      break;
  }
  const auto command = decode_command(packet);
  return command && (command->motors_on || any(command->motor));
}

/// A hand that comes down on the surface at once, and presses on.
inline HandScript pressing_hand() {
  HandScript script;
  script.start = {0, 4, 0};
  script.steps = {hand_move({0, -1, 0}, 0.2), hand_move({0, -1, 0}, 1000)};
  return script;
}

inline Emulator pressed_emulator(Personality personality) {
  return {with_device_params(personality, [](const auto& params) { return make_model(params); }),
          pressing_hand()};
}

/// An emulated device that notes what the packets of its host say of the motors. The front's thread
/// drives it; any thread may ask.
class WatchedDevice final : public PacketDevice {
 public:
  explicit WatchedDevice(Personality personality)
      : personality_(personality), emulator_(pressed_emulator(personality)) {}

  void receive(std::span<const std::uint8_t> packet) noexcept override {
    const bool asks = asks_for_torque(personality_, packet);
    if (pushed_ && !asks) let_go_ns_ = monotonic_ns();
    pushed_ = asks;
    if (asks) has_pushed_ = true;
    emulator_.receive(packet);
  }
  void advance(int cycles) noexcept override { emulator_.advance(cycles); }
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override {
    return emulator_.next_packet();
  }

  [[nodiscard]] bool pushed() const noexcept { return pushed_; }  ///< by its last packet
  [[nodiscard]] bool has_pushed() const noexcept { return has_pushed_; }
  /// When the last packet with torque was followed by one without, CLOCK_MONOTONIC.
  [[nodiscard]] std::int64_t let_go_ns() const noexcept { return let_go_ns_; }

 private:
  Personality personality_;
  Emulator emulator_;
  std::atomic<bool> pushed_{false}, has_pushed_{false};
  std::atomic<std::int64_t> let_go_ns_{0};
};

}  // namespace kerf::test
