// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "controller/load/loaded_scene.hpp"
#include "lab/accuracy/contact_method.hpp"
#include "lab/rig/contact_rig.hpp"

namespace kerf::extremes {

inline constexpr double kVoxelMm = 0.1;

/// The paper's force on a ball in a body of voxels of kVoxelMm, by the servo's method for round
/// tools.
class PaperForce {
 public:
  PaperForce(double radius, const Body& body)
      : volume_{body.grid, kVoxelMm, body.density},
        method_(
            accuracy::contact_method({.storage = accuracy::Storage::aligned, .voxel_mm = kVoxelMm},
                                     volume_, accuracy::ball_tool(radius * kVoxelMm, kVoxelMm))) {}

  /// F = -p0 a^3 SUM grad, a the pitch and the edge of a voxel; N.
  [[nodiscard]] Point at(Point centre) const {
    const double p0_n_per_mm2 = ForceSettings{}.p0_n_per_mm2;
    const auto sum = method_->tool_sum({centre[0], centre[1], centre[2]});
    return -p0_n_per_mm2 * kVoxelMm * kVoxelMm * Point{sum.x, sum.y, sum.z};
  }

 private:
  accuracy::AnalyticVolume volume_;
  std::unique_ptr<accuracy::ContactMethod> method_;
};

}  // namespace kerf::extremes
