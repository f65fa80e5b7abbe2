// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/extremes/hand_run.hpp"
#include "lab/extremes/row.hpp"

namespace kerf::extremes {

/// Force faster than a hand moves is chatter from here on.
inline constexpr double kChatterHz = 150;

/// scenes/NAME.toml with the phantom of this effort. Throws HilError where it cannot be read.
[[nodiscard]] LoadedScene shipped_scene(const std::string& name, const Effort& effort);
/// scenes/touch.toml with another way to cut. Throws HilError where it cannot be read.
[[nodiscard]] LoadedScene hand_scene(const Effort& effort, CutModel cut);
/// The hand of scenes/hands/NAME.toml in it. Throws HilError where it cannot be read.
[[nodiscard]] HandRun run_hand(const LoadedScene& scene, const std::string& name,
                               const Effort& effort);

/// Five hands at an emulated Omni, two of which cut: no chatter in the contact.
[[nodiscard]] std::vector<HandRun> try_hands(const Effort& effort, const RowSink& add_row);

}  // namespace kerf::extremes
