// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/surface/block_bounds.hpp"
#include "visualizer/surface/block_mesh.hpp"

namespace kerf {

/// What can be seen of a volume through parts of the picture, between the near and the far plane:
/// to leave out blocks, and triangles of blocks, of which nothing shows.
class Sight {
 public:
  /// A rectangle of whole pixels in normalised device coordinates; the picture is -1 to 1.
  struct Part {
    glm::dvec2 lo, hi;
  };
  /// Without an eye blocks count that are seen from behind, as where a clip plane opens the
  /// surface.
  Sight(const glm::dmat4& clip_from_voxel, const std::optional<glm::dvec3>& eye_voxel,
        std::span<const Part> parts);

  enum class Shown : std::uint8_t { nothing, some, all };
  /// `nothing` only where nothing in the box is in sight, or all of it is seen from behind; `all`
  /// only where the box lies within one part.
  [[nodiscard]] Shown shown(const BlockBounds& block) const;

  /// For an order from front to back: squared, from the eye to the middle of the block. Without an
  /// eye all are as far.
  [[nodiscard]] float distance_2(VoxelIndex block) const;

  /// Appends to `seen` the triangles of the mesh of a block that may touch a part, in their order.
  void append_seen(const BlockMesh& mesh, const BlockBounds& bounds, VoxelIndex block,
                   std::vector<BlockTriangle>& seen) const;

 private:
  /// Positive inside.
  using Planes = std::array<glm::vec4, 4>;

  std::optional<glm::vec3> eye_;
  std::array<glm::vec4, 2> near_far_;
  Planes around_;  ///< all parts: most blocks lie beyond
  std::vector<Planes> parts_;
};

}  // namespace kerf
