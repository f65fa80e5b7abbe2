// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/vec.hpp"

namespace kerf {

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
