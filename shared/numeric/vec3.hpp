// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

namespace kerf::vec3 {

// Vectors of the code that prepares volumes and meshes at load, in double.

using Vec = std::array<double, 3>;

[[nodiscard]] inline Vec add(const Vec& a, const Vec& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] inline Vec minus(const Vec& a, const Vec& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline Vec scaled(const Vec& a, double s) {
  return {s * a[0], s * a[1], s * a[2]};
}
[[nodiscard]] inline double dot(const Vec& a, const Vec& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double length(const Vec& a) {
  return std::sqrt(dot(a, a));
}
/// Of length 1; zero stays zero.
[[nodiscard]] inline Vec unit(const Vec& a) {
  const double of = length(a);
  return of > 0 ? scaled(a, 1 / of) : a;
}
/// Twice the area of a triangle along its normal.
[[nodiscard]] inline Vec doubled_area(const std::array<Vec, 3>& t) {
  return cross(minus(t[1], t[0]), minus(t[2], t[0]));
}

}  // namespace kerf::vec3
