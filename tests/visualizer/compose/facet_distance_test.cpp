// SPDX-License-Identifier: Apache-2.0
// Distances to a mesh, against a body whose distance is known.
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "visualizer/compose/tool_volume.hpp"

using namespace kerf;

namespace {

constexpr glm::dvec3 kHalf{14.0, 0.7, 2.0};  // mm: long triangles, and some that are hardly wide

/// The box's corners as a mesh, each side in `strips` x 1 pairs of triangles.
Facets box_mesh(const glm::dmat4& world_from_box, int strips) {
  Facets mesh;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      const auto point = [&](double along, double across) {
        glm::dvec3 at{};
        at[axis] = side * kHalf[axis];
        at[u] = along * kHalf[u];
        at[v] = side * across * kHalf[v];
        const glm::dvec3 world(world_from_box * glm::dvec4(at, 1.0));
        mesh.points_mm.push_back({world.x, world.y, world.z});
        return static_cast<std::uint32_t>(mesh.points_mm.size() - 1);
      };
      for (int strip = 0; strip < strips; ++strip) {
        const double from = 2.0 * strip / strips - 1.0, to = 2.0 * (strip + 1) / strips - 1.0;
        const std::uint32_t a = point(from, -1), b = point(to, -1), c = point(to, 1),
                            d = point(from, 1);
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      }
    }
  }
  return mesh;
}

double box_distance(glm::dvec3 at) {
  const glm::dvec3 out = glm::abs(at) - kHalf;
  return glm::length(glm::max(out, 0.0)) + std::min(std::max({out.x, out.y, out.z}), 0.0);
}

}  // namespace

TEST_CASE(
    "distances to a slanting box of long triangles are its own, to the reach and no farther") {
  const glm::dmat4 world_from_box =
      glm::rotate(glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(0.3, -0.2, 0.1)), 0.7,
                              glm::normalize(glm::dvec3(1, 2, -1))),
                  0.5, glm::dvec3(0, 1, 0));
  const glm::dmat4 box_from_world = glm::inverse(world_from_box);
  const GridPoints points{{61, 47, 53}, glm::dvec3(-14.2, -11.0, -12.1), 0.47};
  for (const int strips : {1, 3, 40}) {
    for (const double reach_mm : {0.3, 0.9, 2.5}) {
      CAPTURE(strips);
      CAPTURE(reach_mm);
      const auto distances = facet_distances(box_mesh(world_from_box, strips), points, reach_mm);
      double worst = 0.0;
      int near = 0;
      int inside = 0;
      for (int z = 0; z < points.grid.nz; ++z) {
        for (int y = 0; y < points.grid.ny; ++y) {
          for (int x = 0; x < points.grid.nx; ++x) {
            const glm::dvec3 world = points.first_mm + points.edge_mm * glm::dvec3(x, y, z);
            const double exact =
                std::clamp(box_distance(glm::dvec3(box_from_world * glm::dvec4(world, 1.0))),
                           -reach_mm, reach_mm);
            const auto own = static_cast<double>(distances[points.grid.index(x, y, z)]);
            worst = std::max(worst, std::abs(own - exact));
            near += std::abs(exact) < reach_mm ? 1 : 0;
            inside += exact < 0.0 ? 1 : 0;
          }
        }
      }
      CHECK(near > 500);
      CHECK(inside > 500);
      CHECK(worst < 1e-5);
    }
  }
}
