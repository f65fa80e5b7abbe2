// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/surface/volume_surface.hpp"

namespace kerf {

/// Surfaces as one mesh in the world: what goes into a file.
struct ClosedMesh {
  struct Vertex {
    glm::vec3 position_mm;
    glm::vec3 normal;  ///< outward, of length 1
    glm::vec3 colour;  ///< linear
  };
  std::vector<Vertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside

  /// Adds a volume that stands at `world_from_voxel`, which must not mirror. The vertices that its
  /// blocks share become one, so each side of a triangle belongs to exactly one other triangle.
  void append(const VolumeSurface& surface, const glm::dmat4& world_from_voxel);
};

}  // namespace kerf
