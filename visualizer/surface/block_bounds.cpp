// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/block_bounds.hpp"

#include <algorithm>

namespace kerf {

BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block) {
  if (mesh.vertices.empty()) return {};
  std::array<std::uint16_t, 3> lo = mesh.vertices.front().position;
  std::array<std::uint16_t, 3> hi = lo;
  for (const SurfaceVertex& vertex : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min(lo[axis], vertex.position[axis]);
      hi[axis] = std::max(hi[axis], vertex.position[axis]);
    }
  }
  const VoxelIndex start = block_start(block);
  const glm::vec3 low(lo[0], lo[1], lo[2]);
  const glm::vec3 high(hi[0], hi[1], hi[2]);
  constexpr float kHalfVoxels = 0.5F / float{kFinePerVoxel};
  return {.centre = glm::vec3(start.x, start.y, start.z) + kHalfVoxels * (high + low),
          .half = kHalfVoxels * (high - low)};
}

Sight::Sight(const glm::dmat4& clip_from_voxel, glm::dvec2 lo, glm::dvec2 hi) {
  // A point shows where w*lo <= x <= w*hi and so on (Gribb and Hartmann 2001).
  const glm::dmat4 rows = glm::transpose(clip_from_voxel);
  planes_ = {rows[0] - lo.x * rows[3], hi.x * rows[3] - rows[0], rows[1] - lo.y * rows[3],
             hi.y * rows[3] - rows[1], rows[3] + rows[2],        rows[3] - rows[2]};
  for (glm::vec4& plane : planes_) plane /= glm::length(glm::vec3(plane));
}

bool Sight::may_show(const BlockBounds& block) const {
  constexpr float kSlackVox = 0.01F;  // far more than what float rounds
  return std::all_of(planes_.begin(), planes_.end(), [&](const glm::vec4& plane) {
    const glm::vec3 normal(plane);
    const float reach = glm::dot(glm::abs(normal), block.half) + kSlackVox;
    return glm::dot(normal, block.centre) + plane.w >= -reach;
  });
}

}  // namespace kerf
