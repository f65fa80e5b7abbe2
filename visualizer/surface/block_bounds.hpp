// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <glm/glm.hpp>

#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

/// The box around the vertices of a block, in voxel coordinates.
struct BlockBounds {
  glm::vec3 centre{0.0F};
  glm::vec3 half{0.0F};  ///< of its edges
};
[[nodiscard]] BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block);

/// What can be seen of a volume through a rectangle of the picture, between the near and the far
/// plane; to leave out blocks of which nothing shows. (To leave out those that are seen from behind
/// too gains nothing on a software GL: measured.)
class Sight {
 public:
  /// `lo` and `hi`: the rectangle in normalised device coordinates; the picture is -1 to 1.
  Sight(const glm::dmat4& clip_from_voxel, glm::dvec2 lo, glm::dvec2 hi);

  /// False only where nothing in the box is in sight.
  [[nodiscard]] bool may_show(const BlockBounds& block) const;

 private:
  std::array<glm::vec4, 6> planes_;  ///< positive inside
};

}  // namespace kerf
