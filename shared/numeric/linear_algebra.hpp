// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

/// Vectors in double without a space type: for volumes and meshes at load time, and measurements.
/// The servo's vectors are in `vec.hpp`. Array operators need a using-declaration in each user:
/// `using vec3::operator-;`.
namespace kerf::vec3 {

using Vec = std::array<double, 3>;
using Matrix = std::array<Vec, 3>;  ///< rows

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

/// Rotations in double, with + - * / and square roots alone: the same bits on every machine.
namespace kerf {

using Matrix3 = std::array<double, 9>;     ///< row-major
using Quaternion = std::array<double, 4>;  ///< x, y, z, w

/// The matrix of a unit quaternion.
[[nodiscard]] inline Matrix3 rotation_of(const Quaternion& quaternion) noexcept {
  const auto [x, y, z, w] = quaternion;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
}

/// The unit quaternion of a rotation matrix, w >= 0, without -0 (Shepperd 1978).
[[nodiscard]] inline Quaternion quaternion_of(const Matrix3& m) noexcept {
  // Four times the square of each component; the largest is safe to divide by.
  const std::array<double, 4> square = {1 + m[0] - m[4] - m[8], 1 - m[0] + m[4] - m[8],
                                        1 - m[0] - m[4] + m[8], 1 + m[0] + m[4] + m[8]};
  const auto largest =
      static_cast<std::size_t>(std::max_element(square.begin(), square.end()) - square.begin());
  const double root = std::sqrt(square[largest]);
  Quaternion q{};
  if (largest == 0) q = {root, (m[1] + m[3]) / root, (m[2] + m[6]) / root, (m[7] - m[5]) / root};
  if (largest == 1) q = {(m[1] + m[3]) / root, root, (m[5] + m[7]) / root, (m[2] - m[6]) / root};
  if (largest == 2) q = {(m[2] + m[6]) / root, (m[5] + m[7]) / root, root, (m[3] - m[1]) / root};
  if (largest == 3) q = {(m[7] - m[5]) / root, (m[2] - m[6]) / root, (m[3] - m[1]) / root, root};
  // Not hypot: a square root has the same bits everywhere.
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double scale = (q[3] < 0 ? -1.0 : 1.0) / norm;
  for (double& component : q) component = component == 0 ? 0 : component * scale;
  return q;
}

/// First `b`, then `a`.
[[nodiscard]] inline Matrix3 product(const Matrix3& a, const Matrix3& b) noexcept {
  Matrix3 m{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      m[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    }
  }
  return m;
}

[[nodiscard]] inline vec3::Vec rotated(const Matrix3& rotation, const vec3::Vec& v) noexcept {
  vec3::Vec turned{};
  for (std::size_t i = 0; i < 3; ++i) {
    turned[i] = rotation[3 * i] * v[0] + rotation[3 * i + 1] * v[1] + rotation[3 * i + 2] * v[2];
  }
  return turned;
}

}  // namespace kerf
