// SPDX-License-Identifier: Apache-2.0
#include "visualizer/compose/facet_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace kerf {

namespace {

using Corners = std::array<glm::dvec3, 3>;  // in edges of the grid, from its first point

Corners corners_of(const Facets& facets, std::size_t triangle, const GridPlaces& places) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& p = facets.points_mm[facets.triangles[triangle][k]];
    corners[k] = (glm::dvec3(p[0], p[1], p[2]) - places.first_mm) / places.edge_mm;
  }
  return corners;
}

double distance_to_edge(const glm::dvec3& at, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double square = glm::dot(along, along);
  const double share = square > 0.0 ? std::clamp(glm::dot(at - a, along) / square, 0.0, 1.0) : 0.0;
  return glm::length(at - a - share * along);
}

double distance_to(const Corners& t, const glm::dvec3& at) {
  const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  bool above = glm::dot(normal, normal) > 0.0;
  double nearest = distance_to_edge(at, t[2], t[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 &a = t[k], &b = t[(k + 1) % 3];
    above = above && glm::dot(glm::cross(b - a, at - a), normal) >= 0.0;
    nearest = std::min(nearest, distance_to_edge(at, a, b));
  }
  return above ? std::abs(glm::dot(normal, at - t[0])) / glm::length(normal) : nearest;
}

/// Grid points from `low` to `high`: the first and one after the last.
std::array<std::int32_t, 2> points_between(double low, double high, std::int32_t count) {
  const double first = std::clamp(std::ceil(low), 0.0, static_cast<double>(count));
  const double end = std::clamp(std::floor(high) + 1.0, first, static_cast<double>(count));
  return {static_cast<std::int32_t>(first), static_cast<std::int32_t>(end)};
}

/// Where `dot(normal, at) <= most`.
struct HalfSpace {
  glm::dvec3 normal;
  double most;
};

/// What holds all points within `reach` of a triangle and few others: its plane and its edges moved
/// out; all points where it is hardly more than a line, which says little of its plane.
std::array<HalfSpace, 5> around(const Corners& t, double reach) {
  constexpr double kSlack = 1e-6;  // edges of the grid: more than rounding
  constexpr double kLeastShare = 1e-6;
  std::array<HalfSpace, 5> sides{};
  const glm::dvec3 across = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double size = glm::length(across);
  double longest_2 = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 edge = t[(k + 1) % 3] - t[k];
    longest_2 = std::max(longest_2, glm::dot(edge, edge));
  }
  if (!(size > kLeastShare * longest_2)) return sides;
  const glm::dvec3 normal = across / size;
  const auto side = [&](const glm::dvec3& out, const glm::dvec3& through) {
    return HalfSpace{out, glm::dot(out, through) + reach + kSlack};
  };
  sides[0] = side(normal, t[0]);
  sides[1] = side(-normal, t[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    sides[2 + k] = side(glm::normalize(glm::cross(t[(k + 1) % 3] - t[k], normal)), t[k]);
  }
  return sides;
}

/// Calls `visit(x, y, z)` for the grid points within `reach` of a triangle and few others.
template <class Visit>
void for_points_near(const Corners& t, double reach, const VoxelGrid& grid, const Visit& visit) {
  const glm::dvec3 low = glm::min(glm::min(t[0], t[1]), t[2]) - reach;
  const glm::dvec3 high = glm::max(glm::max(t[0], t[1]), t[2]) + reach;
  const std::array<HalfSpace, 5> sides = around(t, reach);
  const auto [z0, z1] = points_between(low.z, high.z, grid.nz);
  const auto [y0, y1] = points_between(low.y, high.y, grid.ny);
  for (std::int32_t z = z0; z < z1; ++z) {
    for (std::int32_t y = y0; y < y1; ++y) {
      double from = low.x, to = high.x;
      for (const HalfSpace& side : sides) {
        const double left = side.most - side.normal.y * y - side.normal.z * z;
        if (side.normal.x > 0.0) to = std::min(to, left / side.normal.x);
        if (side.normal.x < 0.0) from = std::max(from, left / side.normal.x);
        if (side.normal.x == 0.0 && left < 0.0) to = from - 1.0;
      }
      if (to < from) continue;
      const auto [x0, x1] = points_between(from, to, grid.nx);
      for (std::int32_t x = x0; x < x1; ++x) visit(x, y, z);
    }
  }
}

/// On which side of the line from a to b a point lies, seen along y; the same bits, but for the
/// sign, from b to a.
double side_of(const glm::dvec3& a, const glm::dvec3& b, double x, double z) {
  const bool swapped = a.x != b.x ? a.x > b.x : a.z > b.z;
  const glm::dvec3 &p = swapped ? b : a, &q = swapped ? a : b;
  const double side = (q.x - p.x) * (z - p.z) - (q.z - p.z) * (x - p.x);
  return swapped ? -side : side;
}

/// Adds what a triangle does to the winding numbers of all points below it, at the highest of them.
void wind(const Corners& t, const VoxelGrid& grid, std::vector<std::int32_t>& steps) {
  // Aside of the grid's columns, so that none meets an edge.
  constexpr double kAsideX = 1.3e-6, kAsideZ = 2.1e-6;
  const auto [x_low, x_high] = std::minmax({t[0].x, t[1].x, t[2].x});
  const auto [z_low, z_high] = std::minmax({t[0].z, t[1].z, t[2].z});
  const auto columns_x = points_between(x_low - 1.0, x_high + 1.0, grid.nx);
  const auto columns_z = points_between(z_low - 1.0, z_high + 1.0, grid.nz);
  const auto pierce = [&](std::int32_t ix, std::int32_t iz) {
    const double x = ix + kAsideX, z = iz + kAsideZ;
    const double a = side_of(t[1], t[2], x, z), b = side_of(t[2], t[0], x, z);
    const double c = side_of(t[0], t[1], x, z);
    const bool faces_up = a < 0.0;
    if (a == 0.0 || b == 0.0 || c == 0.0 || (b < 0.0) != faces_up || (c < 0.0) != faces_up) return;
    const double y = (a * t[0].y + b * t[1].y + c * t[2].y) / (a + b + c);
    const auto below = points_between(0.0, std::ceil(y) - 1.0, grid.ny);
    if (below[1] > 0) steps[grid.index(ix, below[1] - 1, iz)] += faces_up ? 1 : -1;
  };
  for (std::int32_t iz = columns_z[0]; iz < columns_z[1]; ++iz) {
    for (std::int32_t ix = columns_x[0]; ix < columns_x[1]; ++ix) pierce(ix, iz);
  }
}

}  // namespace

std::vector<float> facet_distances(const Facets& facets, const GridPlaces& places,
                                   double reach_mm) {
  const VoxelGrid& grid = places.grid;
  const double reach = reach_mm / places.edge_mm;
  std::vector<float> distance(grid.voxel_count(), static_cast<float>(reach_mm));
  std::vector<std::int32_t> winding(distance.size());  // steps of it, from above to below
  for (std::size_t i = 0; i < facets.triangles.size(); ++i) {
    const Corners t = corners_of(facets, i, places);
    for_points_near(t, reach, grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      float& nearest = distance[grid.index(x, y, z)];
      const double own = distance_to(t, glm::dvec3(x, y, z)) * places.edge_mm;
      nearest = std::min(nearest, static_cast<float>(own));
    });
    wind(t, grid, winding);
  }
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = grid.ny - 1; y >= 0; --y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) {
        const std::size_t i = grid.index(x, y, z);
        if (y + 1 < grid.ny) winding[i] += winding[grid.index(x, y + 1, z)];
        if (winding[i] > 0) distance[i] = -distance[i];
      }
    }
  }
  return distance;
}

}  // namespace kerf
