// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "shared/volume/changed_bricks.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// A synthetic molar for timing pictures: a crown with four cusps, two roots, enamel denser than
/// dentin. It is as high as the grid, and fills the same fraction of it as the paper's padded
/// tooth.
class BenchTooth {
 public:
  /// `cropped`: without the air around; the voxels are the same.
  BenchTooth(const VoxelGrid& padded, bool cropped);

  [[nodiscard]] const SceneView& scene() const noexcept { return scene_; }
  [[nodiscard]] const VolumeView& view() const noexcept { return scene_.volumes.front(); }
  /// The tooth's box, which a picture shows: the same, padded or cropped.
  [[nodiscard]] const BoxCorners& looked_at() const noexcept { return looked_at_; }
  [[nodiscard]] const std::vector<Density>& density() const noexcept { return density_; }
  [[nodiscard]] VolumeContent content() const { return {density_, {}}; }

  /// Takes away a ball of `diameter` voxels at the next point on the crown's side that the camera
  /// sees. A dozen points lie apart; after many a small tooth is bored through.
  ChangedBricks cut(int diameter);

 private:
  [[nodiscard]] VoxelIndex next_centre();
  [[nodiscard]] ChangedBrick take_ball(std::uint32_t brick, VoxelIndex centre, double radius);

  SceneView scene_;
  BoxCorners looked_at_{};
  std::vector<Density> density_;
  int cuts_ = 0;
};

}  // namespace kerf
