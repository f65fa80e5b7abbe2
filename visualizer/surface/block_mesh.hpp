// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "visualizer/scene/gradient.hpp"
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
  std::uint16_t openness = 0;               ///< 65535 = 1
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
  /// Turns a normal into the direction inwards where voxel edges are unequal; the largest part
  /// is 1.
  glm::vec3 inverse_square_spacing{1.0F};
  const SurfaceLook* look = nullptr;
  GradientFilter gradient = GradientFilter::corners;  ///< of the normals
};

/// The dirty cells of a block's mesh: triangles in them came, went or changed colour.
class DirtyMeshCells {
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
[[nodiscard]] DirtyMeshCells difference(const BlockMesh& before, const BlockMesh& now);

/// A pure function of the volume; any thread. Positions and triangles depend on the block's own
/// voxels, the rest of a vertex on the voxels around it: see SurfaceLook.
///
/// A vertex stands where the density, linear along its cube edge, passes iso - 1/2 (in steps of
/// Density), to the nearest 1/4096 voxel and never on a voxel: no two vertices of a volume meet,
/// and no triangle has a side of length zero.
[[nodiscard]] BlockMesh extract_block(const SurfaceSource& source, VoxelIndex block);

/// The densities of a block and one voxel around it, in one place and with air outside the volume,
/// so that what reads them needs no test for the border.
class Neighbourhood {
 public:
  static constexpr int kSamples = kBlockEdge + 1;  ///< a side of a block: both ends of its cells
  static constexpr std::array<int, 3> kStride{1, 16, 16 * (kSamples + 2)};  ///< by axis

  Neighbourhood(const VolumeSamples& volume, VoxelIndex start) {
    constexpr int kEdge = kSamples + 2;
    const VoxelIndex lo{start.x - 1, start.y - 1, start.z - 1};
    const VoxelBox in =
        VoxelBox{lo, {lo.x + kEdge, lo.y + kEdge, lo.z + kEdge}}.clipped(volume.grid.box());
    const auto bytes = static_cast<std::size_t>(in.hi.x - in.lo.x) * sizeof(Density);
    for (std::int32_t z = in.lo.z; z < in.hi.z; ++z) {
      for (std::int32_t y = in.lo.y; y < in.hi.y; ++y) {
        std::memcpy(&density_[index(in.lo.x - start.x, y - start.y, z - start.z)],
                    &volume.density[volume.grid.index(in.lo.x, y, z)], bytes);
      }
    }
  }

  /// Sample (0, 0, 0) is the block's start; each part -1..9.
  [[nodiscard]] const Density* at(int x, int y, int z) const { return &density_[index(x, y, z)]; }

  /// `GradientFilter::corners` of a sample 0..8, up to a factor.
  [[nodiscard]] static glm::vec3 corner_gradient(const Density* at) {
    // Sum and difference along x of the four rows, then along y and z.
    std::array<int, 4> sum{};
    std::array<int, 4> rise{};
    for (int row = 0; row < 4; ++row) {
      const Density* middle = at + ((row & 1) * 2 - 1) * kStride[1] + ((row & 2) - 1) * kStride[2];
      sum[static_cast<std::size_t>(row)] = middle[1] + middle[-1];
      rise[static_cast<std::size_t>(row)] = middle[1] - middle[-1];
    }
    return glm::vec3(rise[0] + rise[1] + rise[2] + rise[3], sum[1] - sum[0] + sum[3] - sum[2],
                     sum[2] + sum[3] - sum[0] - sum[1]);
  }
  /// `GradientFilter::central` of a sample 0..8, up to a factor.
  [[nodiscard]] static glm::vec3 central_gradient(const Density* at) {
    return glm::vec3(at[kStride[0]] - at[-kStride[0]], at[kStride[1]] - at[-kStride[1]],
                     at[kStride[2]] - at[-kStride[2]]);
  }

 private:
  static constexpr std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>((z + 1) * kStride[2] + (y + 1) * kStride[1] + x + 1);
  }

  std::array<Density, static_cast<std::size_t>(kStride[2]) * (kSamples + 2)> density_{};
};

/// Computes normal, colour and openness of a vertex from its position and the volume. The vertex
/// belongs to the block that starts at `start`; `near` is that block's neighbourhood. Pure.
void dress(SurfaceVertex& vertex, const SurfaceSource& source, VoxelIndex start,
           const Neighbourhood& near);

/// Brings the mesh of a block up to date after a change of densities in `changed` that touches none
/// of the block's own voxels: positions stay, and the vertices that depend on `changed` are
/// computed again. The result is that of `extract_block`. Returns the cells whose colours changed.
DirtyMeshCells update_look(const SurfaceSource& source, VoxelIndex block, const VoxelBox& changed,
                           BlockMesh& mesh);

}  // namespace kerf
