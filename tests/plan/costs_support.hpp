// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/kernel_shapes.hpp"
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

/// Every set that kerf has, on every processor, without its functions: a plan that called one of
/// them would crash.
inline const std::vector<KernelSet>& planned_sets() {
  static const std::vector<KernelSet> kSets = [] {
    std::vector<KernelSet> sets;
    for (const KernelShape& shape : kKernelShapes) {
      KernelSet& set = sets.emplace_back();
      set.name = shape.name;
      set.lanes = shape.lanes;
      set.can_fuse = shape.can_fuse;
    }
    return sets;
  }();
  return kSets;
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

/// Pose `i` of many: any turn, about the middle of a block of `edge` voxels and not on its lattice.
inline ToolPose<DoubleNumbers> turned_in_block(int edge, int i) {
  ToolPose<DoubleNumbers> pose;
  pose.centre_vox = {edge / 2.0 + i % 7 * 0.13, edge / 2.0 + i % 11 * 0.09, edge / 2.0};
  pose.step = random_turn();
  return pose;
}
inline ToolPose<FixedNumbers> rounded(const ToolPose<DoubleNumbers>& exact) {
  ToolPose<FixedNumbers> pose;
  pose.centre_vox = {Q16(exact.centre_vox.x), Q16(exact.centre_vox.y), Q16(exact.centre_vox.z)};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) pose.step[a][b] = step_of<FixedNumbers>(exact.step[a][b]);
  }
  return pose;
}

}  // namespace kerf::test
