// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "controller/scene/scene_text.hpp"
#include "shared/numeric/vec3.hpp"

namespace kerf {
namespace {

using vec3::cross, vec3::dot, vec3::length, vec3::operator-, vec3::operator*;

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // lower corner first

std::string text_of(const ToolMesh::Point& p) {
  return "(" + short_text(p[0]) + ", " + short_text(p[1]) + ", " + short_text(p[2]) + ")";
}

void check_coordinates(std::span<const LooseTriangle> triangles, double scale,
                       const std::string& place) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const auto& corner : triangles[t]) {
      for (const float x : corner) {
        const double mm = scale * static_cast<double>(x);
        if (std::abs(mm) <= kLargestMeshMm) continue;  // not so for NaN
        refuse(place, ": triangle " + std::to_string(t + 1) + " has the coordinate " +
                          short_text(mm) + " mm; use numbers within " + short_text(kLargestMeshMm) +
                          " mm, check scale");
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

/// By triangle the first one of its part: those that edges join.
std::vector<std::size_t> first_of_parts(const ToolMesh& mesh) {
  std::vector<std::size_t> next(mesh.triangles.size());  // toward the first of the part
  std::iota(next.begin(), next.end(), std::size_t{0});
  const auto first_of = [&](std::size_t t) {
    while (next[t] != t) t = next[t] = next[next[t]];
    return t;
  };
  std::map<Edge, std::size_t> known;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const ToolMesh::Triangle& triangle = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      const std::size_t a = first_of(known.try_emplace(edge, t).first->second), b = first_of(t);
      next[std::max(a, b)] = std::min(a, b);
    }
  }
  for (std::size_t t = 0; t < next.size(); ++t) next[t] = first_of(t);
  return next;
}

/// Triangles of a part and the box around them.
struct Part {
  std::vector<std::size_t> triangles;
  ToolMesh::Point low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  double volume_mm3 = 0;

  [[nodiscard]] bool box_holds(const ToolMesh::Point& p) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (p[axis] < low[axis] || p[axis] > high[axis]) return false;
    }
    return true;
  }
};

std::vector<Part> parts_of(const ToolMesh& mesh) {
  const std::vector<std::size_t> first = first_of_parts(mesh);
  std::vector<Part> by_first(first.size()), parts;
  for (std::size_t t = 0; t < first.size(); ++t) {
    Part& part = by_first[first[t]];
    part.triangles.push_back(t);
    const auto corners = mesh.corners(mesh.triangles[t]);
    for (const ToolMesh::Point& p : corners) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        part.low[axis] = std::min(part.low[axis], p[axis]);
        part.high[axis] = std::max(part.high[axis], p[axis]);
      }
    }
    part.volume_mm3 += dot(corners[0], cross(corners[1], corners[2])) / 6;
  }
  std::ranges::copy_if(by_first, std::back_inserter(parts),
                       [](const Part& part) { return !part.triangles.empty(); });
  return parts;
}

/// How often a part winds around a place: the sum of its triangles' solid angles (Van Oosterom and
/// Strackee 1983) over the sphere's.
double winding(const ToolMesh& mesh, const Part& part, const ToolMesh::Point& at) {
  double half_angles = 0;
  for (const std::size_t t : part.triangles) {
    auto [a, b, c] = mesh.corners(mesh.triangles[t]);
    a = a - at, b = b - at, c = c - at;
    const double la = length(a), lb = length(b), lc = length(c);
    half_angles += std::atan2(dot(a, cross(b, c)),
                              la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return half_angles / (2 * std::numbers::pi);
}

/// Turns what is inside out: all of the mesh, and then each part of it that is no hollow in
/// another. A part is judged after those that it lies in, whatever their order in the file. Gives
/// what they enclose together.
double turn_outward(ToolMesh& mesh) {
  std::vector<Part> parts = parts_of(mesh);
  const auto sum_mm3 = [&] {
    return std::accumulate(parts.begin(), parts.end(), 0.0,
                           [](double sum, const Part& part) { return sum + part.volume_mm3; });
  };
  const auto turn = [&](Part& part) {
    for (const std::size_t t : part.triangles)
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    part.volume_mm3 = -part.volume_mm3;
  };
  // The sum of what `of` makes of how often each other part winds around this one.
  const auto around = [&](const Part& part, auto of) {
    const ToolMesh::Point at = mesh.corners(mesh.triangles[part.triangles.front()])[0];
    double sum = 0;
    for (const Part& other : parts) {
      if (&other != &part && other.box_holds(at)) sum += of(winding(mesh, other, at));
    }
    return sum;
  };
  if (sum_mm3() < 0) std::ranges::for_each(parts, turn);
  std::vector<std::pair<double, Part*>> inside_out;  // by the number of parts that each lies in
  for (Part& part : parts) {
    if (part.volume_mm3 >= 0) continue;
    inside_out.emplace_back(around(part, [](double w) { return std::round(std::abs(w)); }), &part);
  }
  std::ranges::stable_sort(inside_out, {}, &std::pair<double, Part*>::first);
  for (const auto& [depth, part] : inside_out) {
    if (around(*part, [](double w) { return w; }) < 0.5) turn(*part);
  }
  return sum_mm3();
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
        mesh.points_mm.push_back(scale * vec3::Vec{loose[k][0], loose[k][1], loose[k][2]});
    }
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  check_closed(mesh, place);
  stand_in_the_middle(mesh.points_mm);
  const double volume_mm3 = turn_outward(mesh);
  if (volume_mm3 < 1e-9) {
    refuse(place, ": the mesh encloses " + short_text(volume_mm3) +
                      " mm^3; export a solid, check scale (mm per unit of the file)");
  }
  return mesh;
}

}  // namespace kerf
