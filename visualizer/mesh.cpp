// SPDX-License-Identifier: Apache-2.0
#include "visualizer/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kerf {

namespace {

constexpr std::uint32_t kSides = 48;
const double kCosCrease = std::cos(40.0 * std::numbers::pi / 180.0);

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

Outlines tool_outlines(std::span<const ProfilePoint> profile_mm) {
  double radius = 0.0;
  for (const ProfilePoint& point : profile_mm) radius = std::max(radius, point[1]);
  if (radius == 0.0) return {};
  const double low = profile_mm.front()[0];
  const double high = profile_mm.back()[0];
  // A neck that starts inside the head, and the shank of a real bur in proportion to it.
  const double neck = 0.42 * radius;
  const double shank = 0.62 * radius;
  return {{profile_mm.begin(), profile_mm.end()},
          {{0.5 * (low + high), neck},
           {high + 1.5 * radius, neck},
           {high + 2.5 * radius, shank},
           {high + 16.0 * radius, shank}}};
}

Mesh tool_mesh(std::span<const ProfilePoint> profile_mm) {
  Mesh mesh;
  for (const auto& outline : tool_outlines(profile_mm)) mesh.append(lathe(outline));
  return mesh;
}

Mesh unit_cylinder() {
  return lathe(std::array<ProfilePoint, 2>{{{0.0, 1.0}, {1.0, 1.0}}});
}

Mesh unit_cone() {
  return lathe(std::array<ProfilePoint, 2>{{{0.0, 1.0}, {1.0, 0.0}}});
}

}  // namespace kerf
