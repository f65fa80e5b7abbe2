// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "controller/load/loaded_scene.hpp"

namespace kerf {

/// A force law about one length of its spring: what a small swing there meets.
struct LawSlope {
  double spring_mm = 0;
  double stiffness_n_per_mm = 0;  ///< dF/d(spring)
  double damping_ns_per_mm = 0;   ///< -dF/dv outwards
};

/// The force law of a scene along its spring, from an encoder step of the device up to where it
/// gives the scene's largest force, beyond which the limit is flat, or to 10 mm.
///
/// A small swing about a press is that of the wall with these two slopes (linearisation), so the
/// law has a margin of stability at each length. The slopes are quotients over an encoder step,
/// since the loop sees nothing finer, and over 10 mm/s. A law that remembers is taken fresh at each
/// place, one that knows places at the device's origin. In double; a law that gives what is no
/// number has no slope there. Load time; the law has passed its trial (law_trial.hpp).
[[nodiscard]] std::vector<LawSlope> law_slopes(const LoadedScene& scene);

}  // namespace kerf
