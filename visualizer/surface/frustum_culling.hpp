// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
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

/// Culls the blocks of a surface, and the triangles of a block, against the view frustum of each
/// part of a picture that is drawn again. Conservative: what it leaves out covers no pixel; some of
/// what it keeps may cover none either.
class FrustumCulling {
 public:
  /// A rectangle of whole pixels in normalised device coordinates; the picture is -1 to 1.
  struct Part {
    glm::dvec2 lo, hi;
  };
  /// With `eye_voxel`, blocks that turn their back to the eye are culled too. Without it they are
  /// not: a clip plane opens the surface, and its inside shows.
  FrustumCulling(const glm::dmat4& clip_from_voxel, const std::optional<glm::dvec3>& eye_voxel,
                 std::span<const Part> parts);

  enum class Visible : std::uint8_t { nothing, some, all };
  /// `nothing`: the block is outside of all parts, or turns its back to the eye. `all`: it lies
  /// within one part. `some`: neither can be told.
  [[nodiscard]] Visible visible(const BlockBounds& block) const;

  /// Squared distance in voxel edges from the eye to the middle of the block, to sort blocks from
  /// front to back; 0 without an eye.
  [[nodiscard]] float distance_2(VoxelIndex block) const;

  /// Appends to `visible` the triangles of a block's mesh that may touch a part, in their order.
  void append_visible(const BlockMesh& mesh, const BlockBounds& bounds, VoxelIndex block,
                      std::vector<BlockTriangle>& visible) const;

 private:
  /// The four sides of a part's frustum; positive inside.
  using Planes = std::array<glm::vec4, 4>;

  std::optional<glm::vec3> eye_;
  std::array<glm::vec4, 2> near_far_;
  Planes around_;  ///< of the box around all parts: culls most blocks at once
  std::vector<Planes> parts_;
};

}  // namespace kerf
