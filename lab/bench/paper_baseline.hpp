// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "controller/kernel/sampling.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// A voxel as the paper keeps it: 16 bytes.
struct PaperVoxel {
  float density;  ///< 0..1
  float gx, gy, gz;
};

/// Tool place in voxels, rotation row by row; pitch = voxel.
struct PaperPose {
  std::array<float, 3> centre_vox;
  std::array<std::array<float, 3>, 3> rotation;
};

struct PaperTick {
  std::array<float, 3> contact{}, modification{};
  float removed = 0;
};

/// The paper's method in its own form, which every benchmark quotes: an array of structures with
/// the gradient stored as float, samples interpolated one by one, and after a cut the gradient of
/// each touched voxel anew from its 5x5x5 neighbours.
///
/// Straightforward, not slowed down: each sample does its index arithmetic once, and the kernel's
/// 3 x 125 coefficients are a table.
class PaperVolume {
 public:
  PaperVolume(const VoxelGrid& grid, std::span<const Density> density);

  [[nodiscard]] PaperTick feel(std::span<const ToolOffset> tool, const PaperPose& pose) const;
  /// Contact and modification force, then removal of the fraction `k_times_t`, then the gradients.
  PaperTick mill(std::span<const ToolOffset> tool, const PaperPose& pose, float k_times_t);

 private:
  /// Low corner of a tool voxel's cell, and the weights of its corners.
  struct Sample {
    VoxelIndex low;
    std::array<float, 8> weight;
  };
  static Sample sample_of(const ToolOffset& offset, const PaperPose& pose);
  void refresh(const VoxelBox& box);

  VoxelGrid grid_;
  std::vector<PaperVoxel> voxels_;
  std::vector<Sample> samples_;  ///< of one tick, as is the next
  std::vector<float> overlap_;
};

}  // namespace kerf
