// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include "tests/visualizer/gl/gl_fixture.hpp"

namespace kerf::test {

/// Distance in mm to a surface at (x, y, z), negative inside.
using Distance = std::function<double(glm::dvec3)>;

inline double ball_distance(glm::dvec3 at) {
  return glm::length(at) - 4.0;
}
inline double torus_distance(glm::dvec3 at) {
  return glm::length(glm::dvec2(glm::length(glm::dvec2(at.x, at.z)) - 3.0, at.y)) - 1.4;
}

/// A body whose density falls over `ramp_mm` across its surface.
inline std::function<double(glm::dvec3)> body(const Distance& distance, double ramp_mm) {
  return [=](glm::dvec3 at) { return 0.5 - distance(at) / ramp_mm; };
}

/// Where a ray first meets the surface, by going as far as is free; the body is in front of it.
/// None where it misses the body, or grazes a part of it for more than 400 steps.
inline std::optional<double> exact_mm(const Distance& distance, const PixelRay& ray) {
  double t = 0.0;
  for (int i = 0; i < 400; ++i) {
    const double free_mm = distance(ray.origin_mm + t * ray.direction);
    if (free_mm < 1e-10) return t;
    t += free_mm / glm::length(ray.direction);
    if (t > 100.0) return std::nullopt;
  }
  return std::nullopt;
}

inline glm::dvec3 slope_of(const Distance& distance, glm::dvec3 at) {
  constexpr double kStep = 1e-5;
  glm::dvec3 slope;
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 side(0.0);
    side[axis] = kStep;
    slope[axis] = distance(at + side) - distance(at - side);
  }
  return glm::normalize(slope);
}

/// Below this the ray grazes: a small step across is a long way in depth.
inline constexpr double kLeastFacing = 0.35;

}  // namespace kerf::test
