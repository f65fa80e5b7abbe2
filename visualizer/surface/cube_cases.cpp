// SPDX-License-Identifier: Apache-2.0
#include "visualizer/surface/cube_cases.hpp"

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

/// Fills points `first`..`last` of a loop with triangles; false where every way needs a side on a
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

}  // namespace kerf
