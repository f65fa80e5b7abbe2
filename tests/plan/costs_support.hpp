// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdlib>

#include "controller/plan/method/lattice.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/servo/support.hpp"

/// Tools and volumes whose costs are counted.
namespace kerf::test {

inline SceneTool shape(const char* name, double radius_mm, double length_mm) {
  return make_tool(name, name,
                   {.pitch_mm = kVoxelMm, .radius_mm = radius_mm, .length_mm = length_mm});
}

/// All voxels full: every stage does all that it ever does.
inline SceneVolume full_block(int edge) {
  return volume_of(edge, kVoxelMm, [](double, double, double) { return -1.0; });
}

/// A random turn, from a random quaternion.
inline Matrix random_turn() {
  std::array<double, 4> q{};
  double length = 0;
  for (double& part : q) {
    part = std::rand() / (RAND_MAX / 2.0) - 1;
    length += part * part;
  }
  for (double& part : q) part /= std::sqrt(length);
  return matrix_of(q);
}

}  // namespace kerf::test
