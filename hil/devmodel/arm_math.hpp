// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "shared/numeric/vec.hpp"

namespace kerf {

// Helpers of the arms' mechanics: a pose, an end stop, an encoder's count, three linear equations.

/// One pose of an arm, both ways: joint angles and tip that belong together.
struct ArmPose {
  JointVec<double> q;
  DeviceVec<double> tip_mm;
};

/// Takes away the part of `velocity` that drives a stopped angle further. `gradient` is the angle's
/// by the tip, `side` +1 above its range and -1 below: without friction, without bounce.
inline void stop_speed(DeviceVec<double>& velocity, DeviceVec<double> gradient, int side) noexcept {
  const double rate = dot(gradient, velocity);
  if (rate * side > 0) velocity = velocity - gradient * (rate / dot(gradient, gradient));
}

/// What an encoder shows: the floor of the angle in counts from its zero, then 16 bits.
[[nodiscard]] inline std::int16_t encoder_count(int at_zero, double counts) noexcept {
  return static_cast<std::int16_t>(
      static_cast<std::uint16_t>(at_zero + static_cast<int>(std::floor(counts))));
}

/// Three linear equations by Cramer's rule. The matrix must be regular.
template <class To, class From>
[[nodiscard]] Vec<double, From> solve(const Transform<double, To, From>& m,
                                      Vec<double, To> rhs) noexcept {
  const auto& a = m.row;
  const auto determinant = [](double a0, double a1, double a2, double b0, double b1, double b2,
                              double c0, double c1, double c2) {
    return a0 * (b1 * c2 - b2 * c1) - a1 * (b0 * c2 - b2 * c0) + a2 * (b0 * c1 - b1 * c0);
  };
  const double whole =
      determinant(a[0][0], a[0][1], a[0][2], a[1][0], a[1][1], a[1][2], a[2][0], a[2][1], a[2][2]);
  return {determinant(rhs.x, a[0][1], a[0][2], rhs.y, a[1][1], a[1][2], rhs.z, a[2][1], a[2][2]) /
              whole,
          determinant(a[0][0], rhs.x, a[0][2], a[1][0], rhs.y, a[1][2], a[2][0], rhs.z, a[2][2]) /
              whole,
          determinant(a[0][0], a[0][1], rhs.x, a[1][0], a[1][1], rhs.y, a[2][0], a[2][1], rhs.z) /
              whole};
}

}  // namespace kerf
