// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume/material_rule.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// How much of each material has been removed, brick by brick: the most that a brick has held since
/// this was made, less what it holds now. Matter that comes back is no longer counted, also where a
/// reset brings back what was gone before. Memory: a byte for each voxel.
class MaterialScore {
 public:
  MaterialScore(const SceneView& scene, std::span<const VolumeContent> contents);

  /// Some bricks of a volume are others now. Costs their voxels.
  void update(std::size_t volume, std::span<const Density> density,
              std::span<const std::uint32_t> bricks);

  /// By index of the scene's materials; 0 is matter of none.
  [[nodiscard]] std::vector<double> removed_mm3() const;

 private:
  struct Volume {
    BrickGrid bricks;
    double step_mm3 = 0.0;               ///< of a step of density in a voxel
    std::vector<Label> material;         ///< by voxel
    std::vector<std::uint32_t> matter;   ///< steps by brick and material
    std::vector<std::uint32_t> fullest;  ///< the most of them so far
    std::vector<std::int64_t> removed;   ///< steps by material
  };
  /// Counts the matter of a brick anew; what it lacks of its fullest is removed.
  void count(Volume& volume, std::span<const Density> density, std::uint32_t brick) const;

  std::size_t materials_;
  std::vector<Volume> volumes_;
};

}  // namespace kerf
