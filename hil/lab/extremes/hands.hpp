// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hil/lab/extremes/hand_run.hpp"
#include "hil/lab/extremes/row.hpp"

namespace kerf::extremes {

/// Force faster than a hand moves is chatter from here on.
inline constexpr double kChatterHz = 150;

/// scenes/NAME.toml with the phantom of this effort. Throws HilError where it cannot be read.
[[nodiscard]] Scene shipped_scene(const std::string& name, const Effort& effort);
/// scenes/touch.toml with another way to cut. Throws HilError where it cannot be read.
[[nodiscard]] Scene hand_scene(const Effort& effort, CutModel cut);
/// The hand of scenes/hands/NAME.toml in it. Throws HilError where it cannot be read.
[[nodiscard]] HandRun run_hand(const Scene& scene, const std::string& name, const Effort& effort);

/// Five hands at an emulated Omni, two of which cut: no chatter in the contact.
[[nodiscard]] std::vector<HandRun> try_hands(const Effort& effort, const Told& told);

}  // namespace kerf::extremes
