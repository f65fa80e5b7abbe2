// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "lab/rig/points.hpp"

namespace kerf::extremes {

/// Share of full density by signed distance as a CT has it: edges blurred by a deviation of one
/// voxel, and 2 % of noise.
class CtEdge {
 public:
  double operator()(double distance) {
    return 0.5 * std::erfc(distance / std::sqrt(2.0)) + 0.02 * normal();
  }

 private:
  /// From the normal distribution, mean 0 and deviation 1 (Box and Muller 1958).
  double normal() {
    const double r = std::sqrt(-2 * std::log(dice_.uniform(1e-12, 1)));
    return r * std::cos(2 * std::numbers::pi * dice_.uniform(0, 1));
  }

  Dice dice_{9};
};

}  // namespace kerf::extremes
