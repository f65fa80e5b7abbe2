// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/gl/target.hpp"
#include "visualizer/scene_view.hpp"

namespace kerf {

/// Which pixels of an iso-surface a change reaches along their normal: the shading looks inwards
/// for the material, and outwards for what coats and what darkens the surface (`material_at` and
/// `openness_at` in iso.frag). So a voxel matters to a point up to twelve edges away, but only to
/// one whose normal points there.
///
/// For points whose normal has not changed. It asks the density for that, as the shaders do, and
/// leaves room for what these round.
class Feelers {
 public:
  /// How far from a voxel, in voxel edges, it has a share in a point's normal.
  static constexpr int kNormalReachVox = 2;
  /// How far a point can feel it; one is for the interpolation.
  static constexpr int kReachVox = 13;

  /// `differs` of `density` (the whole volume) have changed. Spans and `volume` of the caller.
  Feelers(const VolumeView& volume, std::span<const Density> density,
          std::span<const VoxelBox> differs, const View& view, PictureSize size);

  /// Whether a tile whose nearest and farthest pixels have these window depths may hold such
  /// pixels: a look at its corners.
  [[nodiscard]] bool may_reach(const PixelRect& tile, float nearest, float farthest) const;
  /// Whether the shade of pixel (x, y), whose surface is at this window depth, may have changed.
  [[nodiscard]] bool may_reach(int x, int y, float window_depth);

 private:
  using Row = float __attribute__((vector_size(16)));
  struct Box {
    glm::vec3 lo, hi;
  };

  /// The gradients at the corners of a cube of eight voxels: many pixels show the same one.
  struct Cell {
    bool made = false;
    VoxelIndex at;  ///< its lowest corner
    /// By corner in y and z; of both in x the z parts, then the x parts; the y parts.
    std::array<Row, 4> z_and_x, y;
  };

  /// From the eye to a pixel's centre, 1 mm along the view axis.
  [[nodiscard]] glm::vec3 direction(int x, int y) const;
  [[nodiscard]] float eye_mm(float window_depth) const;
  [[nodiscard]] float seen_from(const glm::vec3& along, float t) const;
  [[nodiscard]] float nearest_end(const glm::vec3& along) const;
  /// Whether one of the feelers of a point does.
  [[nodiscard]] bool ends_in_change(const glm::vec3& at, const glm::vec3& outward) const;
  [[nodiscard]] glm::vec3 gradient_at(const glm::vec3& voxel);
  [[nodiscard]] const Cell& cell_at(VoxelIndex at);

  VoxelGrid grid_;
  std::span<const Density> density_;
  glm::mat3 voxel_from_eye_;
  glm::mat3 outward_from_gradient_;  ///< up to a factor, where the surface faces the eye
  glm::vec3 origin_;                 ///< the eye, in voxel edges
  glm::vec2 first_direction_, direction_per_pixel_;
  float near_mm_, far_mm_;
  std::vector<Box> ends_;                   ///< where the end of a feeler finds a change
  Box any_end_;                             ///< around all of them
  Box within_;                              ///< from where one can be felt
  glm::vec3 eye_centre_{}, eye_half_[3]{};  ///< `any_end_` in eye space
  std::array<Cell, 128> cells_;             ///< made so far, by their place
  float longest_edge_mm_ = 0.0F;            ///< of a voxel
};

}  // namespace kerf
