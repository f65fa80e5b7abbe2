// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf::test {

using Triangles = std::span<const std::array<std::uint32_t, 3>>;

/// Sides of triangles that have no partner: the same two ends the other way round, exactly once.
/// 0 for a closed, oriented surface without branches.
[[nodiscard]] inline std::size_t open_sides(Triangles triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const auto& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++uses[{t[i], t[(i + 1) % 3]}];
  }
  std::size_t open = 0;
  for (const auto& [side, count] : uses) {
    const auto partner = uses.find({side.second, side.first});
    open += count != 1 || partner == uses.end() || partner->second != 1 ? 1 : 0;
  }
  return open;
}

/// Vertices - sides + triangles of a closed mesh: 2 for a ball, 0 for a torus, per piece.
[[nodiscard]] inline long euler_number(const ClosedMesh& mesh) {
  const auto triangles = static_cast<long>(mesh.triangles.size());
  return static_cast<long>(mesh.vertices.size()) - triangles * 3 / 2 + triangles;
}

using Shape = std::function<double(glm::dvec3)>;  ///< signed distance in mm, negative inside

[[nodiscard]] inline Shape ball_shape(glm::dvec3 centre, double radius) {
  return [=](glm::dvec3 at) { return glm::length(at - centre) - radius; };
}
/// About the z axis.
[[nodiscard]] inline Shape torus_shape(double ring, double tube) {
  return [=](glm::dvec3 at) { return std::hypot(std::hypot(at.x, at.y) - ring, at.z) - tube; };
}
[[nodiscard]] inline std::function<double(glm::dvec3)> density_of(const Shape& shape,
                                                                  double ramp_mm) {
  return [=](glm::dvec3 at) { return 0.5 - shape(at) / ramp_mm; };
}

[[nodiscard]] inline VolumeSurface surface_of(const TestVolume& volume) {
  return VolumeSurface(volume.view, {}, volume.density, {});
}
[[nodiscard]] inline ClosedMesh closed(const VolumeSurface& surface, const TestVolume& volume) {
  ClosedMesh mesh;
  mesh.append(surface, volume.view.world_from_voxel);
  return mesh;
}
[[nodiscard]] inline ClosedMesh closed(const TestVolume& volume) {
  return closed(surface_of(volume), volume);
}

struct Measures {
  double area_mm2 = 0.0;
  double volume_mm3 = 0.0;
  double least_area_mm2 = 1e300;  ///< of a triangle
};
[[nodiscard]] inline Measures measure(const ClosedMesh& mesh) {
  Measures sum;
  for (const auto& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices[t[0]].position_mm;
    const glm::dvec3 b = mesh.vertices[t[1]].position_mm;
    const glm::dvec3 c = mesh.vertices[t[2]].position_mm;
    const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
    sum.area_mm2 += area;
    sum.least_area_mm2 = std::min(sum.least_area_mm2, area);
    sum.volume_mm3 += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return sum;
}

}  // namespace kerf::test
