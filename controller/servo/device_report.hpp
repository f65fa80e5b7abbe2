// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace kerf {

/// What the device said in this tick, as it came: counts, not angles. The only input of the servo
/// step besides commands, and therefore what a replay needs.
///
/// `parked` is the sign that the hand is not at work: the stylus sits in the inkwell (Omni), the
/// centre button of the grip is held (Falcon), the arm has not left the home pose since its
/// calibration button was pressed (WoodenHaptics). Parked at rest calibrates; motors stay off while
/// parked.
struct DeviceReport {
  bool fresh = false;                      ///< false: nothing arrived since the last tick
  std::array<std::int16_t, 3> encoder{};   ///< counts, wrap at 16 bits
  std::array<std::uint16_t, 3> wiper_a{};  ///< gimbal pots, both wipers; zero where there is none
  std::array<std::uint16_t, 3> wiper_b{};
  bool button1 = false, button2 = false;  ///< pressed
  bool parked = false;
  bool homed = true;          ///< false: absolute encoders have no meaning yet
  std::uint32_t counter = 0;  ///< packet counter of the device, or of the driver where it has none
};

/// A change asked for by a person or a program; applied at a tick boundary.
struct ServoCommand {
  enum class Kind : std::uint32_t {
    none,
    select_tool,
    hold,
    fade_in,  ///< force starts again from 0: after a stall of the servo
    reset,    ///< the volumes' first content, over some ticks; at once where nothing is cut
    undo      ///< the volumes before the last stroke, likewise; refused where there is none
  };
  Kind kind = Kind::none;
  std::uint32_t argument = 0;  ///< index of the tool; hold: 1 on, 0 off
};

}  // namespace kerf
