// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/block_bounds.hpp"

#include <algorithm>

namespace kerf {

namespace {

constexpr float kHalfVoxels = 0.5F / float{kFinePerVoxel};

}  // namespace

BlockBounds bounds_of(const BlockMesh& mesh, VoxelIndex block) {
  if (mesh.vertices.empty()) return {};
  const auto place = [&](std::uint16_t vertex) {
    const auto& at = mesh.vertices[vertex].position;
    return glm::vec3(at[0], at[1], at[2]);
  };
  glm::vec3 low = place(0), high = low;
  for (const SurfaceVertex& vertex : mesh.vertices) {
    const glm::vec3 at(vertex.position[0], vertex.position[1], vertex.position[2]);
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  glm::vec3 normal_low(1.0F), normal_high(-1.0F);
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::vec3 normal = glm::normalize(glm::cross(place(b) - place(a), place(c) - place(a)));
    normal_low = glm::min(normal_low, normal);
    normal_high = glm::max(normal_high, normal);
  }
  const VoxelIndex start = block_start(block);
  return {.centre = glm::vec3(start.x, start.y, start.z) + kHalfVoxels * (high + low),
          .half = kHalfVoxels * (high - low),
          .normal_centre = 0.5F * (normal_high + normal_low),
          .normal_half = 0.5F * (normal_high - normal_low)};
}

}  // namespace kerf
