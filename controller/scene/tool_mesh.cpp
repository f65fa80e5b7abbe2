// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/tool_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "controller/scene/scene_text.hpp"
#include "controller/scene/vec3.hpp"

namespace kerf {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // lower corner first

std::string text_of(const ToolMesh::Point& p) {
  return "(" + number_text(p[0]) + ", " + number_text(p[1]) + ", " + number_text(p[2]) + ")";
}

void check_coordinates(std::span<const LooseTriangle> triangles, double scale,
                       const std::string& place) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const auto& corner : triangles[t]) {
      for (const float x : corner) {
        const double mm = scale * static_cast<double>(x);
        if (std::abs(mm) <= kLargestMeshMm) continue;  // not so for NaN
        refuse(place, ": triangle " + std::to_string(t + 1) + " has the coordinate " +
                          number_text(mm) + " mm; use numbers within " +
                          number_text(kLargestMeshMm) + " mm, check scale");
      }
    }
  }
}

/// How often each edge is passed upward, from the lower corner to the higher, and downward.
struct Passes {
  int up = 0, down = 0;
};

void check_closed(const ToolMesh& mesh, const std::string& place) {
  std::map<Edge, Passes> edges;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      Passes& passes = edges[std::minmax(a, b)];
      ++(a < b ? passes.up : passes.down);
    }
  }
  for (const auto& [edge, passes] : edges) {
    if (passes.up == passes.down) continue;
    const std::string ends = "the edge from " + text_of(mesh.points_mm[edge.first]) + " to " +
                             text_of(mesh.points_mm[edge.second]) + " mm";
    if ((passes.up + passes.down) % 2 == 1) {
      refuse(place, ": not closed, " + ends + " has no partner; close the hole there");
    }
    refuse(place, ": the triangles at " + ends +
                      " are turned against each other; let all be counter-clockwise from outside");
  }
}

double volume_mm3(const ToolMesh& mesh) {
  double sum = 0;
  for (const ToolMesh::Triangle& t : mesh.triangles) {
    const auto [a, b, c] = mesh.corners(t);
    sum += vec3::dot(a, vec3::cross(b, c)) / 6;
  }
  return sum;
}

/// Puts the middle of the height at 0, in whole nanometres.
void stand_in_the_middle(std::vector<ToolMesh::Point>& points_mm) {
  const auto [low, high] = std::minmax_element(
      points_mm.begin(), points_mm.end(), [](const auto& a, const auto& b) { return a[1] < b[1]; });
  const double middle_mm = ((*low)[1] + (*high)[1]) / 2;
  for (ToolMesh::Point& p : points_mm) {
    p[1] -= middle_mm;
    // Zero is added to lose the sign of -0.
    for (double& x : p) x = std::round(x * 1e6) / 1e6 + 0.0;
  }
}

}  // namespace

ToolMesh join_triangles(std::span<const LooseTriangle> triangles, double scale,
                        const std::string& place) {
  if (triangles.empty()) refuse(place, ": no triangles; export a closed mesh");
  if (triangles.size() > kMaxMeshTriangles) {
    refuse(place, ": " + std::to_string(triangles.size()) + " triangles, above the limit of " +
                      std::to_string(kMaxMeshTriangles) + "; simplify the mesh");
  }
  check_coordinates(triangles, scale, place);
  ToolMesh mesh;
  std::map<std::array<float, 3>, std::uint32_t> known;
  for (const LooseTriangle& loose : triangles) {
    ToolMesh::Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto next = static_cast<std::uint32_t>(mesh.points_mm.size());
      const auto [at, is_new] = known.try_emplace(loose[k], next);
      t[k] = at->second;
      if (is_new)
        mesh.points_mm.push_back(vec3::scaled({loose[k][0], loose[k][1], loose[k][2]}, scale));
    }
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  check_closed(mesh, place);
  stand_in_the_middle(mesh.points_mm);
  const double volume = volume_mm3(mesh);
  if (std::abs(volume) < 1e-9) {
    refuse(place, ": the mesh encloses " + number_text(std::abs(volume)) +
                      " mm^3; export a solid, check scale (mm per unit of the file)");
  }
  if (volume < 0) {
    for (ToolMesh::Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  return mesh;
}

}  // namespace kerf
