// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "controller/scene/scene.hpp"

namespace kerf::energy {

/// Work of the hand around closed ways on a static ball, by the servo's own ledger.
struct LoopWork {
  std::string model;    ///< proxy, proxy with friction, paper
  std::string numeric;  ///< fixed, float, double
  /// |SUM dW| / SUM |dW| of the contact force as if never sampled: 0 for a force with a potential.
  double share = 0;
  double friction_mj = 0;  ///< a loop; taken from the hand
  double leak_mj = 0;      ///< a loop; of the sample and hold
  double most_share = 0;   ///< that `share` may have
};

/// Two laps on each of six tilted circles of 0.375 mm about places on a ball of 3 mm, with a ball
/// of 1 mm pressed 0.6 mm into it and nothing cut; the arm's counts are the hand's places.
[[nodiscard]] std::vector<LoopWork> closed_loops();

}  // namespace kerf::energy
