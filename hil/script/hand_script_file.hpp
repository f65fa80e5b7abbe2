// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "hil/device/hand_script.hpp"

namespace kerf {

/// Reads a hand script, TOML of at most 1 MiB and 10000 steps:
///
///     unit_mm  = 1.0             # device mm per unit of length below; if missing, the scene's
///     start_mm = [0, 5, 0]       # first point above the surface
///     [device]                   # any key of kPlantKeys that belongs to it; options win
///     coulomb_n = 0.1
///     [hand]                     # any key of kPlantKeys that belongs to it; options win
///     mass_kg = 0.1
///     [[step]]                   # exactly one of move_mm, hold, circle_mm, zigzag_mm
///     move_mm = [0, -1, 0]       # absolute, origin = surface point under the tool, y up
///     seconds = 0.5
///     ease = "smooth"            # or "linear"
///     button = 1                 # 1 or 2: pressed during this step
///     orientation_deg = [0, 20, 0]  # gimbal yaw, pitch from upright, roll, reached at its end
///     [[step]]
///     hold = 0.5                 # seconds
///     [[step]]
///     repeat = true              # from here to the end again and again
///     circle_mm = 2.0            # radius around the present point, in the horizontal plane
///     turns = 3
///     seconds = 2
///     sink_mm = 1                # ends this much lower
///     [[step]]
///     zigzag_mm = [3, 4]         # strokes along x, once there and back along z
///     turns = 6
///     seconds = 2
///
/// Strict: an unknown key, a wrong type or a value out of range throws `HilError` that names file
/// and line. Start-up only.
[[nodiscard]] HandScript read_hand_script(const std::filesystem::path& file);

/// Reads a hand script from text; `location` names it in errors.
[[nodiscard]] HandScript parse_hand_script(std::string_view text, const std::string& location);

}  // namespace kerf
