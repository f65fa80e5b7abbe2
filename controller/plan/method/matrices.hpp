// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "shared/numeric/rotation.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

// Matrices of the scene compiler: made in double, then rounded to the loop's numbers.

using Matrix = std::array<std::array<double, 3>, 3>;

[[nodiscard]] inline Matrix matrix_of(const std::array<double, 4>& quaternion) {
  const Matrix3 m = rotation_of(quaternion);
  return {{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}};
}

/// row_scale * transpose(rotation): world to the volume's axes.
[[nodiscard]] inline Matrix into_volume(const Matrix& rotation,
                                        const std::array<double, 3>& row_scale) {
  Matrix m{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = row_scale[i] * rotation[j][i];
  }
  return m;
}

template <class S, class To, class From>
[[nodiscard]] Transform<S, To, From> rounded(const Matrix& m) {
  Transform<S, To, From> t;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) t.row[i][j] = S(m[i][j]);
  }
  return t;
}

template <class V, class S>
[[nodiscard]] V rounded(const std::array<double, 3>& v) {
  return {S(v[0]), S(v[1]), S(v[2])};
}

/// Voxels as a step of the loop's numbers.
template <class N>
[[nodiscard]] typename N::Step step_of(double voxels) {
  if constexpr (N::kIsFixed) {
    return static_cast<std::int32_t>(std::lround(voxels * N::kStepOne));
  } else {
    return static_cast<typename N::Step>(voxels);
  }
}

}  // namespace kerf
