// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/cast/gradient_rows.hpp"
#include "visualizer/surface/vertex_shading.hpp"
#include "visualizer/surface/volume_samples.hpp"

namespace kerf {

/// Marching cubes (Lorensen and Cline 1987): what the surface looks like within a cube, by which of
/// its eight corners are solid.
///
/// Corner c stands at (c & 1, c >> 1 & 1, c >> 2). Edge e = 4*axis + i runs along `axis` from the
/// i-th of the four corners that have 0 there, counted along axis+1, then axis+2 (mod 3).
///
/// The lists are worked out from two rules at compile time, so no table has to be trusted:
///  - what is drawn on a face follows from its four corners alone: each run of solid corners around
///    the face gets one line, so two solid corners across a diagonal stay apart. Cubes that share a
///    face agree on it, and the surface has no hole;
///  - no triangle's inner side lies on a face, where the neighbour might have the same one.
/// So every side belongs to exactly two triangles, whatever the volume holds.
inline constexpr std::size_t kCubeEdges = 12;
using CubeTriangle = std::array<std::uint8_t, 3>;  ///< edges; counter-clockwise from the air

/// The corner that an edge starts from; it ends at that | 1 << axis.
[[nodiscard]] constexpr unsigned edge_start(unsigned edge) noexcept {
  const unsigned axis = edge / 4;
  return (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
}

/// Bit c of `solid` is corner c; `solid` < 256.
[[nodiscard]] std::span<const CubeTriangle> cube_triangles(unsigned solid) noexcept;

/// A block has 8^3 cells between voxel centres; block (i, j, k) starts at voxel 8i-1, so that the
/// first and the last cells lie between the volume and the air around it: the surface is closed at
/// the volume's border too. (The macrocells of `iso` stand in the same way.)
inline constexpr std::int32_t kBlockEdge = 8;
[[nodiscard]] constexpr VoxelIndex block_start(VoxelIndex block) noexcept {
  return {block.x * kBlockEdge - 1, block.y * kBlockEdge - 1, block.z * kBlockEdge - 1};
}
/// Blocks along each axis of a volume.
[[nodiscard]] constexpr VoxelGrid block_grid(const VoxelGrid& volume) noexcept {
  return {volume.nx / kBlockEdge + 1, volume.ny / kBlockEdge + 1, volume.nz / kBlockEdge + 1};
}

/// As it goes to the GPU; attributes of surface.vert.
struct SurfaceVertex {
  std::array<std::uint16_t, 3> position{};  ///< 1/4096 voxel from `block_start`
  std::array<std::int16_t, 3> normal{};     ///< outward, of length 32767 in voxel coordinates
  std::array<std::uint16_t, 3> colour{};    ///< linear, 65535 = 1
  std::uint16_t ao_factor = 0;              ///< 65535 = 1
  friend bool operator==(const SurfaceVertex&, const SurfaceVertex&) = default;
};

/// Where a vertex of the block that starts at `start` stands in the volume.
[[nodiscard]] inline FinePoint fine_place(const SurfaceVertex& vertex, VoxelIndex start) noexcept {
  const auto& at = vertex.position;
  return FinePoint(start.x, start.y, start.z) * kFinePerVoxel + FinePoint(at[0], at[1], at[2]);
}

/// Vertices by number, counter-clockwise from the air.
using BlockTriangle = std::array<std::uint16_t, 3>;
/// At most one on each edge of its cells.
inline constexpr std::size_t kMostBlockVertices =
    std::size_t{3} * kBlockEdge * (kBlockEdge + 1) * (kBlockEdge + 1);

/// The surface within one block. A cube edge that the surface cuts has one vertex; blocks that meet
/// have equal vertices on the face between them.
struct BlockMesh {
  std::vector<SurfaceVertex> vertices;
  std::vector<BlockTriangle> triangles;
  friend bool operator==(const BlockMesh&, const BlockMesh&) = default;
};

/// What a mesh is made from, and how it looks.
struct SurfaceSource {
  VolumeSamples volume;
  Density iso = 1;  ///< solid from here up; at least 1
  /// 1 / spacing^2 of each axis, scaled so that the largest is 1. A vertex normal times this is the
  /// direction, in voxels, of the normal in the world.
  glm::vec3 inverse_square_spacing{1.0F};
  const VertexShading* shading = nullptr;
  const GradientRows* gradient = nullptr;  ///< of the normals
};

/// The changed cells of a block's mesh: triangles in them came, went or changed colour.
class ChangedMeshCells {
 public:
  /// The cells around the edge that this vertex stands on.
  void add(const SurfaceVertex& vertex) noexcept;
  [[nodiscard]] bool any() const noexcept;
  /// Appends the triangles of a mesh of `block` that lie in these cells.
  void append_triangles(const BlockMesh& mesh, VoxelIndex block,
                        std::vector<FineTriangle>& to) const;

 private:
  /// Bit x of rows_[z][y]. No triangle lies between two cells, see the case lists above.
  std::array<std::array<std::uint8_t, kBlockEdge>, kBlockEdge> rows_{};
};

/// The cells in which two meshes of one block differ.
[[nodiscard]] ChangedMeshCells difference(const BlockMesh& before, const BlockMesh& now);

/// A pure function of the volume; any thread. Positions and triangles depend on the block's own
/// voxels, the rest of a vertex on the voxels around it: see VertexShading.
///
/// A vertex stands where the density, linear along its cube edge, passes iso - 1/2 (in steps of
/// Density), to the nearest 1/4096 voxel and never on a voxel: no two vertices of a volume meet,
/// and no triangle has a side of length zero.
[[nodiscard]] BlockMesh extract_block(const SurfaceSource& source, VoxelIndex block);

/// The voxels around a change on which the colour, or the whole look, of a vertex depends.
[[nodiscard]] VoxelBox coloured_around(const VoxelBox& changed, const GradientRows& gradient);
[[nodiscard]] VoxelBox shaded_around(const VoxelBox& changed, const SurfaceSource& source);

/// Brings the mesh of a block up to date after a change of densities in `changed` that touches none
/// of the block's own voxels: positions stay, and the vertices that depend on `changed` are
/// computed again. The result is that of `extract_block`. Returns the cells whose colours changed.
ChangedMeshCells update_shading(const SurfaceSource& source, VoxelIndex block,
                                const VoxelBox& changed, BlockMesh& mesh);

}  // namespace kerf
