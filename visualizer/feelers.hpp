// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/gl/target.hpp"
#include "visualizer/scene_view.hpp"

namespace kerf {

/// Which pixels of an iso-surface a change can reach from afar: the shading looks out along the
/// normal for what darkens the surface (`openness_at` in iso.frag), so a voxel matters to a point
/// up to twelve edges away, but only to one whose normal points there.
///
/// For points whose own surroundings have not changed. It asks the density for their normals, as
/// the shaders do, and leaves room for what these round.
class Feelers {
 public:
  /// How far from a voxel, in voxel edges, a surface point can feel it; one for the interpolation.
  static constexpr int kReachVox = 13;

  /// `differs` of `density` (the whole volume) have changed. Spans and `volume` of the caller.
  Feelers(const VolumeView& volume, std::span<const Density> density,
          std::span<const VoxelBox> differs, const View& view, PictureSize size);

  /// Whether the shade of pixel (x, y), whose surface is at this window depth, may have changed.
  [[nodiscard]] bool may_reach(int x, int y, float window_depth) const;

 private:
  struct Box {
    glm::vec3 lo, hi;
    [[nodiscard]] bool contains(const glm::vec3& p) const;
  };

  [[nodiscard]] glm::vec3 gradient_at(const glm::vec3& voxel) const;

  VoxelGrid grid_;
  std::span<const Density> density_;
  glm::mat3 voxel_from_eye_;
  glm::vec3 origin_;  ///< the eye, in voxel edges
  glm::vec2 first_direction_, direction_per_pixel_;
  float near_mm_, far_mm_;
  std::vector<Box> ends_;                   ///< where the end of a feeler finds a change
  Box within_;                              ///< from where one can
  glm::vec3 eye_centre_{}, eye_half_[3]{};  ///< the box of all `ends_`, in eye space
};

}  // namespace kerf
