// SPDX-License-Identifier: Apache-2.0

#include "visualizer/compose/tool_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kerf {

namespace {

constexpr std::uint32_t kSides = 48;
constexpr double kCreaseDegrees = 40.0;
const double kCosCrease = std::cos(kCreaseDegrees * std::numbers::pi / 180.0);

// Neck and shank of a real bur, in radii of its head; the last three from the head's end.
constexpr double kNeckPerRadius = 0.42;
constexpr double kShankPerRadius = 0.62;
constexpr double kNeckRadii = 1.5;
constexpr double kShankFromRadii = 2.5;
constexpr double kShankToRadii = 16.0;

/// Outward normal (y, radial) of the wall between two profile points.
glm::dvec2 wall_normal(const ProfilePoint& low, const ProfilePoint& high) {
  const glm::dvec2 normal(low[1] - high[1], high[0] - low[0]);
  return normal / glm::length(normal);
}

void append_ring(Mesh& mesh, const ProfilePoint& at, const glm::dvec2& normal) {
  for (std::uint32_t i = 0; i <= kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    mesh.vertices.push_back(
        {glm::vec3(at[1] * c, at[0], at[1] * s), glm::vec3(normal.y * c, normal.x, normal.y * s)});
  }
}

}  // namespace

void Mesh::append(const Mesh& other) {
  const auto base = static_cast<std::uint32_t>(vertices.size());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const std::uint32_t index : other.triangles) triangles.push_back(base + index);
}

Mesh lathe(std::span<const ProfilePoint> profile) {
  std::vector<ProfilePoint> points;
  for (const ProfilePoint& point : profile) {
    if (points.empty() || points.back() != point) points.push_back(point);
  }
  if (points.size() < 2) return {};
  if (points.front()[1] > 0.0) points.insert(points.begin(), {points.front()[0], 0.0});
  if (points.back()[1] > 0.0) points.push_back({points.back()[0], 0.0});

  const std::size_t walls = points.size() - 1;
  const auto normal_at = [&](std::size_t wall, std::size_t point) {
    const glm::dvec2 own = wall_normal(points[wall], points[wall + 1]);
    const std::size_t other = point == wall ? wall - 1 : wall + 1;  // wraps below 0: no wall
    if (other >= walls) return own;
    const glm::dvec2 next = wall_normal(points[other], points[other + 1]);
    return glm::dot(own, next) < kCosCrease ? own : glm::normalize(own + next);
  };
  Mesh mesh;
  glm::dvec2 last_normal(0.0);
  for (std::size_t wall = 0; wall < walls; ++wall) {
    // Walls that meet smoothly have the same normals there, and share the ring.
    const glm::dvec2 low_normal = normal_at(wall, wall), high_normal = normal_at(wall, wall + 1);
    if (low_normal != last_normal) append_ring(mesh, points[wall], low_normal);
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size()) - (kSides + 1);
    append_ring(mesh, points[wall + 1], high_normal);
    last_normal = high_normal;
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t low = base + i;
      const std::uint32_t high = low + kSides + 1;
      mesh.triangles.insert(mesh.triangles.end(), {low, high, low + 1, low + 1, high, high + 1});
    }
  }
  return mesh;
}

Mesh shaded(const Facets& facets) {
  const auto point = [&](std::uint32_t i) {
    const auto& p = facets.points_mm[i];
    return glm::dvec3(p[0], p[1], p[2]);
  };
  std::vector<glm::dvec3> area;  // by triangle, along its normal
  std::vector<std::vector<std::size_t>> meeting(facets.points_mm.size());
  for (const auto& [a, b, c] : facets.triangles) {
    for (const std::uint32_t corner : {a, b, c}) meeting[corner].push_back(area.size());
    area.push_back(glm::cross(point(b) - point(a), point(c) - point(a)));
  }
  Mesh mesh;
  for (std::size_t t = 0; t < area.size(); ++t) {
    const double own = glm::length(area[t]);
    if (!(own > 1e-12)) continue;  // mm^2: no face to see
    for (const std::uint32_t corner : facets.triangles[t]) {
      glm::dvec3 normal(0.0);
      for (const std::size_t other : meeting[corner]) {
        const double product = own * glm::length(area[other]);
        if (glm::dot(area[t], area[other]) >= kCosCrease * product) normal += area[other];
      }
      mesh.triangles.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
      mesh.vertices.push_back({glm::vec3(point(corner)), glm::vec3(glm::normalize(normal))});
    }
  }
  return mesh;
}

Outlines tool_outlines(const ToolView& tool) {
  if (tool.radius_mm == 0.0) return {};
  double low = 0.0, high = 0.0;
  Outlines outlines;
  if (tool.facets.triangles.empty()) {
    low = tool.profile_mm.front()[0];
    high = tool.profile_mm.back()[0];
    outlines.push_back(tool.profile_mm);
  }
  for (const auto& [x, y, z] : tool.facets.points_mm) {
    low = std::min(low, y);
    high = std::max(high, y);
  }
  if (!tool.shaft_mm.empty()) {
    outlines.push_back(tool.shaft_mm);
    return outlines;
  }
  // The neck starts inside the head.
  const double neck = kNeckPerRadius * tool.radius_mm;
  const double shank = kShankPerRadius * tool.radius_mm;
  outlines.push_back({{0.5 * (low + high), neck},
                      {high + kNeckRadii * tool.radius_mm, neck},
                      {high + kShankFromRadii * tool.radius_mm, shank},
                      {high + kShankToRadii * tool.radius_mm, shank}});
  return outlines;
}

Mesh tool_mesh(const ToolView& tool) {
  Mesh mesh = shaded(tool.facets);
  for (const auto& outline : tool_outlines(tool)) mesh.append(lathe(outline));
  return mesh;
}

Mesh unit_cylinder() {
  return lathe(std::array<ProfilePoint, 2>{{{0.0, 1.0}, {1.0, 1.0}}});
}

Mesh unit_cone() {
  return lathe(std::array<ProfilePoint, 2>{{{0.0, 1.0}, {1.0, 0.0}}});
}

}  // namespace kerf
