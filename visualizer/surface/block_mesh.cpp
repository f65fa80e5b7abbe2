// SPDX-License-Identifier: Apache-2.0

#include "visualizer/surface/block_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>
#include <utility>

namespace kerf {

namespace {

constexpr std::size_t kMostTriangles = 5;  // more would not compile

struct CubeCase {
  std::uint8_t triangles = 0;
  std::array<CubeTriangle, kMostTriangles> list{};
};

using Loop = std::array<std::uint8_t, kCubeEdges>;

constexpr unsigned edge_between(unsigned a, unsigned b) {
  const unsigned axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  const unsigned low = a & b;
  return 4 * axis + (low >> (axis + 1) % 3 & 1) + 2 * (low >> (axis + 2) % 3 & 1);
}

/// Whether both edges are sides of one face.
constexpr bool share_face(unsigned a, unsigned b) {
  const auto faces = [](unsigned edge) {
    const unsigned axis = edge / 4;
    return 1U << (2 * ((axis + 1) % 3) + (edge & 1)) |
           1U << (2 * ((axis + 2) % 3) + (edge >> 1 & 1));
  };
  return (faces(a) & faces(b)) != 0;
}

constexpr bool is_solid(unsigned solid, unsigned corner) {
  return (solid >> corner & 1) != 0;
}

/// The lines on all faces: for each cut edge the one that the surface goes on to, with solid on the
/// left as seen from outside the cube.
constexpr Loop lines_of(unsigned solid) {
  Loop next{};
  for (unsigned face = 0; face < 6; ++face) {
    const unsigned u = 1U << (face / 2 + 1) % 3;
    const unsigned v = 1U << (face / 2 + 2) % 3;
    const unsigned side = (face & 1) << face / 2;
    // Counter-clockwise from outside.
    std::array<unsigned, 4> ring{side, side | u, side | u | v, side | v};
    if (side == 0) std::swap(ring[1], ring[3]);
    for (unsigned start = 0; start < 4; ++start) {
      if (is_solid(solid, ring[start]) || !is_solid(solid, ring[(start + 1) % 4])) continue;
      unsigned end = start + 1;
      while (is_solid(solid, ring[(end + 1) % 4])) ++end;
      next[edge_between(ring[start], ring[(start + 1) % 4])] =
          static_cast<std::uint8_t>(edge_between(ring[end % 4], ring[(end + 1) % 4]));
    }
  }
  return next;
}

/// Fills points `first`..`last` of a loop with triangles; false if every way needs a side on a
/// face.
constexpr bool fill(const Loop& loop, std::size_t first, std::size_t last, CubeCase& out) {
  if (last - first < 2) return true;
  const auto inner = [&](std::size_t a, std::size_t b) {
    return b - a == 1 || !share_face(loop[a], loop[b]);
  };
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    if (!inner(first, apex) || !inner(apex, last)) continue;
    const std::uint8_t before = out.triangles;
    out.list[out.triangles++] = {loop[first], loop[apex], loop[last]};
    if (fill(loop, first, apex, out) && fill(loop, apex, last, out)) return true;
    out.triangles = before;
  }
  return false;
}

constexpr CubeCase case_of(unsigned solid) {
  const Loop next = lines_of(solid);
  CubeCase out;
  unsigned done = 0;
  for (unsigned edge = 0; edge < kCubeEdges; ++edge) {
    const unsigned start = edge_start(edge);
    const bool cut = is_solid(solid, start) != is_solid(solid, start | 1U << edge / 4);
    if (!cut || (done >> edge & 1) != 0) continue;
    Loop loop{};
    std::size_t points = 0;
    for (unsigned at = edge; (done >> at & 1) == 0; at = next[at]) {
      done |= 1U << at;
      loop[points++] = static_cast<std::uint8_t>(at);
    }
    if (!fill(loop, 0, points - 1, out)) throw "a loop without a triangulation";  // no such case
  }
  return out;
}

// One evaluation per case: compilers bound the work of each.
template <unsigned Solid>
constexpr CubeCase kCase = case_of(Solid);

template <unsigned... Solid>
constexpr std::array<CubeCase, sizeof...(Solid)> all_cases(
    std::integer_sequence<unsigned, Solid...>) {
  return {kCase<Solid>...};
}

constexpr auto kCases = all_cases(std::make_integer_sequence<unsigned, 256>{});

}  // namespace

std::span<const CubeTriangle> cube_triangles(unsigned solid) noexcept {
  const CubeCase& found = kCases[solid];
  return {found.list.data(), found.triangles};
}

namespace {

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

 private:
  static constexpr std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>(z + 1) * static_cast<std::size_t>(kStride[2]) +
           static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(kStride[1]) +
           static_cast<std::size_t>(x + 1);
  }

  std::array<Density, static_cast<std::size_t>(kStride[2]) * (kSamples + 2)> density_{};
};

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

constexpr float kNormalLength = 32767.0F;

/// To the nearest; for |value| < 2^15.
int rounded(float value) {
  return static_cast<int>(value + 32768.5F) - 32768;
}

std::uint16_t unit16(float fraction) {
  return static_cast<std::uint16_t>(std::clamp(fraction, 0.0F, 1.0F) * 65535.0F + 0.5F);
}

/// From what the vertex holds, not from what it was made of: to do it again gives the same bits.
glm::vec3 normal_of(const SurfaceVertex& vertex) {
  return {vertex.normal[0], vertex.normal[1], vertex.normal[2]};
}

/// As VertexShading takes it; of `normal_of`.
FinePoint inward_of(const SurfaceVertex& vertex, const glm::vec3& inverse_square_spacing) {
  glm::vec3 along = normal_of(vertex);
  float length = kNormalLength;
  if (inverse_square_spacing != glm::vec3(1.0F)) {
    along *= inverse_square_spacing;
    length = std::sqrt(glm::dot(along, along));
  }
  const glm::vec3 step = along * (-float{kFinePerVoxel} / length);
  return {rounded(step.x), rounded(step.y), rounded(step.z)};
}

/// Computes normal, colour and ambient occlusion of a vertex from its position and the volume. The
/// vertex belongs to the block that starts at `start`; `near` is that block's neighbourhood. Pure.
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
  VoxelIndex end{start.x + from[0], start.y + from[1], start.z + from[2]};
  const glm::vec3 low_slope = source.gradient->at(end);
  (axis == 0 ? end.x : axis == 1 ? end.y : end.z) += 1;
  const glm::vec3 high_slope = source.gradient->at(end);
  const glm::vec3 slope =
      source.gradient->plan().per_edge *
      glm::mix(low_slope, high_slope, static_cast<float>(along) / float{kFinePerVoxel});
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
  const glm::vec3 colour = source.shading->colour(source.volume, at, inward);
  vertex.colour = {unit16(colour.r), unit16(colour.g), unit16(colour.b)};
  vertex.ao_factor = unit16(source.shading->ao_factor(source.volume, at, normal_of(vertex)));
}

}  // namespace

void ChangedMeshCells::add(const SurfaceVertex& vertex) noexcept {
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

bool ChangedMeshCells::any() const noexcept {
  return rows_ != ChangedMeshCells{}.rows_;
}

void ChangedMeshCells::append_triangles(const BlockMesh& mesh, VoxelIndex block,
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

ChangedMeshCells difference(const BlockMesh& before, const BlockMesh& now) {
  ChangedMeshCells cells;
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

VoxelBox coloured_around(const VoxelBox& changed, const GradientRows& gradient) {
  return gradient.plan().around(changed).grown(1);  // a vertex lies between two voxels
}

VoxelBox shaded_around(const VoxelBox& changed, const SurfaceSource& source) {
  return coloured_around(changed, *source.gradient)
      .united(grown(changed, source.shading->ao_reach()));
}

ChangedMeshCells update_shading(const SurfaceSource& source, VoxelIndex block,
                                const VoxelBox& changed, BlockMesh& mesh) {
  const VoxelIndex start = block_start(block);
  const VoxelBox colours = coloured_around(changed, *source.gradient);
  const VoxelBox all = shaded_around(changed, source);
  std::optional<Neighbourhood> near;
  ChangedMeshCells cells;
  for (SurfaceVertex& vertex : mesh.vertices) {
    const SurfaceVertex before = vertex;
    const FinePoint at = fine_place(vertex, start);
    const VoxelIndex voxel = VolumeSamples::voxel_below(at);
    if (!all.contains(voxel)) continue;
    if (colours.contains(voxel)) {
      if (!near) near.emplace(source.volume, start);
      dress(vertex, source, start, *near);
    } else {
      const glm::vec3 normal = normal_of(vertex);
      if (!source.shading->ao_depends_on(changed, at, normal)) continue;
      vertex.ao_factor = unit16(source.shading->ao_factor(source.volume, at, normal));
    }
    if (vertex != before) cells.add(vertex);
  }
  return cells;
}

}  // namespace kerf
