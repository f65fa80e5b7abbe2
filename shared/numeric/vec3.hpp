// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

/// Vectors in double where no space has to be kept apart: volumes and meshes at load, measurements.
/// The servo's vectors are those of `vec.hpp`. The operators of an array have to be named where
/// they are used: `using vec3::operator-;`.
namespace kerf::vec3 {

using Vec = std::array<double, 3>;

[[nodiscard]] inline Vec operator+(const Vec& a, const Vec& b) noexcept {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] inline Vec operator-(const Vec& a, const Vec& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline Vec operator*(double s, const Vec& a) noexcept {
  return {s * a[0], s * a[1], s * a[2]};
}
[[nodiscard]] inline double dot(const Vec& a, const Vec& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Vec cross(const Vec& a, const Vec& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double length(const Vec& a) noexcept {
  return std::sqrt(dot(a, a));
}
/// Of length 1; zero stays zero.
[[nodiscard]] inline Vec unit(const Vec& a) noexcept {
  const double of = length(a);
  return of > 0 ? 1 / of * a : a;
}
/// Twice the area of a triangle along its normal.
[[nodiscard]] inline Vec doubled_area(const std::array<Vec, 3>& t) noexcept {
  return cross(t[1] - t[0], t[2] - t[0]);
}

}  // namespace kerf::vec3
