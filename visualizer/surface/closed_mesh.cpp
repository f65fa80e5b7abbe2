// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/closed_mesh.hpp"

#include <algorithm>
#include <unordered_map>

#include <glm/gtc/matrix_inverse.hpp>

namespace kerf {

namespace {

/// On a face of its block, where another block may have it too.
bool is_shared(const SurfaceVertex& vertex) {
  constexpr int kEnd = kBlockEdge * kFinePerVoxel;
  return std::any_of(vertex.position.begin(), vertex.position.end(),
                     [](std::uint16_t at) { return at == 0 || at == kEnd; });
}

/// The cube edge that a vertex lies on: its axis and start, 17 bits each.
std::uint64_t edge_of(FinePoint at) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key = key << 17 | static_cast<std::uint64_t>((at[axis] >> kFineLog2) + 1);
  }
  for (int axis = 0; axis < 3; ++axis) {
    key = key << 1 | ((at[axis] & (kFinePerVoxel - 1)) != 0 ? 1U : 0U);
  }
  return key;
}

}  // namespace

void ClosedMesh::append(const VolumeSurface& surface, const glm::dmat4& world_from_voxel) {
  const glm::dmat3 world_from_normal = glm::inverseTranspose(glm::dmat3(world_from_voxel));
  std::unordered_map<std::uint64_t, std::uint32_t> shared;
  std::vector<std::uint32_t> index;  // of the block's vertices here
  for (std::uint32_t id = 0; id < surface.meshes().size(); ++id) {
    const BlockMesh& block = surface.meshes()[id];
    const VoxelIndex start = block_start(surface.block(id));
    index.clear();
    for (const SurfaceVertex& vertex : block.vertices) {
      const FinePoint at = fine_place(vertex, start);
      const auto fresh = static_cast<std::uint32_t>(vertices.size());
      const std::uint32_t known =
          is_shared(vertex) ? shared.try_emplace(edge_of(at), fresh).first->second : fresh;
      index.push_back(known);
      if (known != fresh) continue;
      const glm::dvec3 voxel = glm::dvec3(at) / double{kFinePerVoxel};
      const glm::dvec3 normal(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
      constexpr float kOne = 65535.0F;
      vertices.push_back({glm::vec3(world_from_voxel * glm::dvec4(voxel, 1.0)),
                          glm::vec3(glm::normalize(world_from_normal * normal)),
                          glm::vec3(vertex.colour[0], vertex.colour[1], vertex.colour[2]) / kOne});
    }
    for (const auto& triangle : block.triangles) {
      triangles.push_back({index[triangle[0]], index[triangle[1]], index[triangle[2]]});
    }
  }
}

}  // namespace kerf
