// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/block_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <utility>

#include "visualizer/surface/cube_cases.hpp"
#include "visualizer/surface/neighbourhood.hpp"
#include "visualizer/surface/vertex_look.hpp"

namespace kerf {

namespace {

constexpr unsigned kSamples = Neighbourhood::kSamples;

/// Eight densities at once; both compilers have it for every processor.
using Lanes = Density __attribute__((vector_size(kBlockEdge * sizeof(Density))));

/// Whether the densities in `box` of the volume lie on both sides of iso; outside is air.
bool has_surface(const VolumeSamples& volume, const VoxelBox& box, Density iso) {
  const VoxelBox in = box.clipped(volume.grid.box());
  if (in.empty()) return false;
  const std::ptrdiff_t width = in.hi.x - in.lo.x;
  bool some_solid = false;
  bool some_air = in != box;
  for (std::int32_t z = in.lo.z; z < in.hi.z; ++z) {
    auto solid = Lanes{} != 0;
    auto air = solid;
    for (std::int32_t y = in.lo.y; y < in.hi.y; ++y) {
      const Density* row = &volume.density[volume.grid.index(in.lo.x, y, z)];
      if (width < kBlockEdge) {
        for (const Density* at = row; at < row + width; ++at) {
          (*at >= iso ? some_solid : some_air) = true;
        }
        continue;
      }
      for (const Density* at : {row, row + width - kBlockEdge}) {  // they overlap
        Lanes lanes;
        std::memcpy(&lanes, at, sizeof(lanes));
        const auto here = lanes >= iso;
        solid |= here;
        air |= ~here;
      }
    }
    for (int i = 0; i < kBlockEdge; ++i) {
      some_solid = some_solid || solid[i] != 0;
      some_air = some_air || air[i] != 0;
    }
    if (some_solid && some_air) return true;
  }
  return false;
}

/// Finds vertices and triangles of one block.
class Extraction {
 public:
  Extraction(const Neighbourhood& near, Density iso) : near_(near), iso_(iso) {}

  BlockMesh run() {
    find_solid();
    for (unsigned z = 0; z < kSamples; ++z) {
      for (unsigned y = 0; y < kSamples; ++y) {
        constexpr unsigned kAll = (1U << kSamples) - 1;
        const unsigned row = solid_[z][y];
        cut_edges<0>((row ^ row >> 1) & kAll >> 1, y, z);
        if (y + 1 < kSamples) cut_edges<1>(row ^ solid_[z][y + 1], y, z);
        if (z + 1 < kSamples) cut_edges<2>(row ^ solid_[z + 1][y], y, z);
      }
    }
    for (unsigned z = 0; z < kBlockEdge; ++z) {
      for (unsigned y = 0; y < kBlockEdge; ++y) join_row(y, z);
    }
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] const Density* sample(unsigned x, unsigned y, unsigned z) const {
    return near_.at(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
  }

  /// Bit x of solid_[z][y].
  void find_solid() {
    for (unsigned z = 0; z < kSamples; ++z) {
      for (unsigned y = 0; y < kSamples; ++y) {
        const Density* row = sample(0, y, z);
        unsigned bits = 0;
        for (unsigned x = 0; x < kSamples; ++x) bits |= (row[x] >= iso_ ? 1U : 0U) << x;
        solid_[z][y] = bits;
      }
    }
  }

  /// A vertex on each edge along `Axis` that starts at (x, y, z), x from `bits`.
  template <unsigned Axis>
  void cut_edges(unsigned bits, unsigned y, unsigned z) {
    for (; bits != 0; bits &= bits - 1) {
      const auto x = static_cast<unsigned>(std::countr_zero(bits));
      vertex_[Axis][z][y][x] = static_cast<std::uint16_t>(mesh_.vertices.size());
      const Density* low = sample(x, y, z);
      const int rise = low[Neighbourhood::kStride[Axis]] - low[0];
      // (iso - 1/2 - low) / rise, to the nearest; both have the same sign.
      const int along = ((2 * (iso_ - low[0]) - 1) * (kFinePerVoxel / 2) + rise / 2) / rise;
      const std::array<unsigned, 3> from{x, y, z};
      SurfaceVertex& vertex = mesh_.vertices.emplace_back();
      for (unsigned axis = 0; axis < 3; ++axis) {
        vertex.position[axis] = static_cast<std::uint16_t>(from[axis] << kFineLog2);
      }
      vertex.position[Axis] = static_cast<std::uint16_t>(vertex.position[Axis] +
                                                         std::clamp(along, 1, kFinePerVoxel - 1));
    }
  }

  /// The triangles of the cells of one row.
  void join_row(unsigned y, unsigned z) {
    const std::array<unsigned, 4> rows{solid_[z][y], solid_[z][y + 1], solid_[z + 1][y],
                                       solid_[z + 1][y + 1]};
    const unsigned some = rows[0] | rows[1] | rows[2] | rows[3];
    const unsigned every = rows[0] & rows[1] & rows[2] & rows[3];
    unsigned mixed = (some | some >> 1) & ~(every & every >> 1) & ((1U << kBlockEdge) - 1);
    for (; mixed != 0; mixed &= mixed - 1) {
      const auto x = static_cast<unsigned>(std::countr_zero(mixed));
      unsigned corners = 0;
      for (unsigned i = 0; i < rows.size(); ++i) corners |= (rows[i] >> x & 3) << 2 * i;
      for (const CubeTriangle& triangle : cube_triangles(corners)) {
        mesh_.triangles.push_back({vertex_on(triangle[0], x, y, z), vertex_on(triangle[1], x, y, z),
                                   vertex_on(triangle[2], x, y, z)});
      }
    }
  }

  [[nodiscard]] std::uint16_t vertex_on(unsigned edge, unsigned x, unsigned y, unsigned z) const {
    const unsigned start = edge_start(edge);
    return vertex_[edge / 4][z + (start >> 2)][y + (start >> 1 & 1)][x + (start & 1)];
  }

  const Neighbourhood& near_;
  int iso_;
  std::array<std::array<unsigned, kSamples>, kSamples> solid_{};
  /// By axis and start of the edge; set only for edges that are cut.
  std::uint16_t vertex_[3][kSamples][kSamples][kSamples];
  BlockMesh mesh_;
};

/// The order in which `Extraction` finds vertices: by the start of their edge in z and y, then by
/// the axis along which it runs, then by the start in x.
unsigned place_in_order(const SurfaceVertex& vertex) {
  const auto& at = vertex.position;
  constexpr unsigned kRest = kFinePerVoxel - 1;  // never 0 along the edge, always 0 across
  const unsigned axis = (at[0] & kRest) != 0 ? 0 : (at[1] & kRest) != 0 ? 1 : 2;
  const auto voxel = [&](std::size_t i) { return unsigned{at[i]} >> kFineLog2; };
  return ((voxel(2) * kSamples + voxel(1)) * 3 + axis) * kSamples + voxel(0);
}

}  // namespace

void DirtyMeshCells::add(const SurfaceVertex& vertex) noexcept {
  // By axis the first and the last cell; along the edge both are the same.
  std::array<unsigned, 3> first{}, last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const unsigned at = vertex.position[axis];
    last[axis] = std::min(at >> kFineLog2, unsigned{kBlockEdge - 1});
    first[axis] = at == 0 ? 0 : (at - 1) >> kFineLog2;
  }
  const auto row = static_cast<std::uint8_t>(1U << first[0] | 1U << last[0]);
  for (unsigned z = first[2]; z <= last[2]; ++z) {
    for (unsigned y = first[1]; y <= last[1]; ++y) rows_[z][y] |= row;
  }
}

bool DirtyMeshCells::any() const noexcept {
  return rows_ != DirtyMeshCells{}.rows_;
}

void DirtyMeshCells::append_triangles(const BlockMesh& mesh, VoxelIndex block,
                                      std::vector<FineTriangle>& to) const {
  if (!any()) return;
  const VoxelIndex start = block_start(block);
  for (const BlockTriangle& triangle : mesh.triangles) {
    const SurfaceVertex* corner[3];
    for (std::size_t i = 0; i < 3; ++i) corner[i] = &mesh.vertices[triangle[i]];
    const auto cell = [&](std::size_t axis) {  // that holds the middle
      const int sum =
          corner[0]->position[axis] + corner[1]->position[axis] + corner[2]->position[axis];
      return static_cast<unsigned>(sum / (3 * kFinePerVoxel));
    };
    if ((rows_[cell(2)][cell(1)] >> cell(0) & 1) == 0) continue;
    to.push_back({fine_place(*corner[0], start), fine_place(*corner[1], start),
                  fine_place(*corner[2], start)});
  }
}

DirtyMeshCells difference(const BlockMesh& before, const BlockMesh& now) {
  DirtyMeshCells cells;
  if (before == now) return cells;
  // Vertices come and go; those of both have the same order.
  auto old = before.vertices.begin();
  const auto is_next = [&](auto&& compare, const SurfaceVertex& vertex) {
    return old != before.vertices.end() && compare(place_in_order(*old), place_in_order(vertex));
  };
  for (const SurfaceVertex& vertex : now.vertices) {
    while (is_next(std::less<>(), vertex)) cells.add(*old++);
    const bool stays = is_next(std::equal_to<>(), vertex);
    if (!stays || *old != vertex) cells.add(vertex);
    if (stays) ++old;
  }
  std::for_each(old, before.vertices.end(), [&](const SurfaceVertex& gone) { cells.add(gone); });
  return cells;
}

BlockMesh extract_block(const SurfaceSource& source, VoxelIndex block) {
  constexpr std::int32_t kEdge = Neighbourhood::kSamples;
  const VoxelIndex start = block_start(block);
  const VoxelBox samples{start, {start.x + kEdge, start.y + kEdge, start.z + kEdge}};
  if (!has_surface(source.volume, samples, source.iso)) return {};
  const Neighbourhood near(source.volume, start);
  BlockMesh mesh = Extraction(near, source.iso).run();
  for (SurfaceVertex& vertex : mesh.vertices) dress(vertex, source, start, near);
  return mesh;
}

}  // namespace kerf
