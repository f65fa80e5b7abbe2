// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/block_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "visualizer/surface/cube_cases.hpp"
#include "visualizer/surface/neighbourhood.hpp"

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

constexpr float kNormalLength = 32767.0F;

/// To the nearest; for |value| < 2^15.
int rounded(float value) {
  return static_cast<int>(value + 32768.5F) - 32768;
}

std::uint16_t unit16(float share) {
  return static_cast<std::uint16_t>(share * 65535.0F + 0.5F);
}

/// From what the vertex holds, not from what it was made of: to do it again gives the same bits.
FinePoint inward_of(const SurfaceVertex& vertex, const glm::vec3& inverse_square_spacing) {
  glm::vec3 along(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
  float length = kNormalLength;
  if (inverse_square_spacing != glm::vec3(1.0F)) {
    along *= inverse_square_spacing;
    length = std::sqrt(glm::dot(along, along));
  }
  const glm::vec3 step = along * (-float{kFinePerVoxel} / length);
  return {rounded(step.x), rounded(step.y), rounded(step.z)};
}

/// Fills in all but the position of a vertex.
void dress(SurfaceVertex& vertex, const SurfaceSource& source, VoxelIndex start,
           const Neighbourhood& near) {
  std::array<int, 3> from{};
  std::size_t axis = 0;  // along which its cube edge runs
  int along = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    from[i] = vertex.position[i] >> kFineLog2;
    const int rest = vertex.position[i] & (kFinePerVoxel - 1);
    if (rest != 0) {
      axis = i;
      along = rest;
    }
  }
  const Density* low = near.at(from[0], from[1], from[2]);
  const Density* high = low + Neighbourhood::kStride[axis];
  const glm::vec3 slope = glm::mix(Neighbourhood::gradient(low), Neighbourhood::gradient(high),
                                   static_cast<float>(along) / float{kFinePerVoxel});
  const float length = std::sqrt(glm::dot(slope, slope));
  glm::vec3 outward(0.0F);
  if (length > 0.0F) {
    outward = slope * (-1.0F / length);
  } else {  // a lone voxel looks the same on all sides
    outward[static_cast<int>(axis)] = *high > *low ? -1.0F : 1.0F;
  }
  for (int i = 0; i < 3; ++i) {
    vertex.normal[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>(rounded(outward[i] * kNormalLength));
  }
  const FinePoint at = fine_place(vertex, start);
  const FinePoint inward = inward_of(vertex, source.inverse_square_spacing);
  const glm::vec3 colour = source.look->colour(source.volume, at, inward);
  vertex.colour = {unit16(colour.r), unit16(colour.g), unit16(colour.b)};
  vertex.openness = unit16(source.look->openness(source.volume, at, inward));
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

}  // namespace

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

bool update_look(const SurfaceSource& source, VoxelIndex block, const VoxelBox& changed,
                 BlockMesh& mesh) {
  const VoxelIndex start = block_start(block);
  const VoxelBox colours = changed.grown(SurfaceLook::kColourReachVox);
  const VoxelBox all = changed.grown(SurfaceLook::kOpennessReachVox);
  std::optional<Neighbourhood> near;
  bool differs = false;
  for (SurfaceVertex& vertex : mesh.vertices) {
    const SurfaceVertex before = vertex;
    const FinePoint at = fine_place(vertex, start);
    const VoxelIndex voxel = VolumeSamples::voxel_below(at);
    if (!all.contains(voxel)) continue;
    if (colours.contains(voxel)) {
      if (!near) near.emplace(source.volume, start);
      dress(vertex, source, start, *near);
    } else {
      const FinePoint inward = inward_of(vertex, source.inverse_square_spacing);
      if (!SurfaceLook::openness_depends_on(changed, at, inward)) continue;
      vertex.openness = unit16(source.look->openness(source.volume, at, inward));
    }
    differs = differs || vertex != before;
  }
  return differs;
}

}  // namespace kerf
