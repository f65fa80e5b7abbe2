// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace kerf
