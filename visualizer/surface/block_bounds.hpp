// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

/// Where the surface of a block lies and which way it faces, in voxel coordinates.
struct BlockBounds {
  glm::vec3 centre{0.0F};
  glm::vec3 half{0.0F};  ///< of the edges of the box around its vertices
  /// The box around the unit normals of its triangles.
  glm::vec3 normal_centre{0.0F};
  glm::vec3 normal_half{0.0F};
};
[[nodiscard]] BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block);

/// What can be seen of a volume through parts of the picture, between the near and the far plane:
/// to leave out blocks of which nothing shows.
class Sight {
 public:
  /// A rectangle in normalised device coordinates; the picture is -1 to 1.
  struct Part {
    glm::dvec2 lo, hi;
  };
  /// Without an eye blocks count that are seen from behind, as where a clip plane opens the
  /// surface.
  Sight(const glm::dmat4& clip_from_voxel, const std::optional<glm::dvec3>& eye_voxel,
        std::span<const Part> parts);

  /// False only where nothing in the box is in sight, or all of it is seen from behind.
  [[nodiscard]] bool may_show(const BlockBounds& block) const;

 private:
  /// Positive inside.
  using Planes = std::array<glm::vec4, 4>;

  std::optional<glm::vec3> eye_;
  std::array<glm::vec4, 2> near_far_;
  Planes around_;  ///< all parts: most blocks lie beyond
  std::vector<Planes> parts_;
};

}  // namespace kerf
