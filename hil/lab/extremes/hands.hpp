// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hil/lab/extremes/hand_run.hpp"
#include "hil/lab/extremes/row.hpp"

namespace kerf::extremes {

/// Force faster than a hand moves is chatter from here on.
inline constexpr double kChatterHz = 150;

/// The scripted hands of scenes/hands at an emulated Omni in scenes/proxy.toml: no chatter in the
/// contact. Throws HilError where scene or scripts cannot be read.
[[nodiscard]] std::vector<HandRun> try_hands(const Effort& effort, const Told& told);

}  // namespace kerf::extremes
