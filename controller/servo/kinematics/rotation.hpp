// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <numbers>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

template <class N>
struct SineCosine {
  typename N::Unit sine, cosine;
};

/// Sine and cosine by their Taylor series in nested form. No libm: its last bit differs between
/// versions.
///
/// Joints stay below 1.8 rad. What is beyond 2 rad comes back by half turns, pi each: a gimbal near
/// its ends, and counts that jump or have no zero yet, up to the 8 rad where `Angle` ends. There
/// the series would give a matrix that is no rotation, and a tool longer than its table says.
///
/// Truncation: 2^19/19! = 4.3e-12 and 2^18/18! = 4.1e-11; fixed point adds at most 3e-8, which is
/// 4e-6 mm at an arm of 133 mm.
template <class N>
[[nodiscard]] constexpr SineCosine<N> sine_cosine(typename N::Angle angle) noexcept {
  using A = typename N::Angle;
  constexpr int kTerms = 8;
  constexpr int kMostHalfTurns = 2;  // 8 - 2 pi < 2
  const A one(1), pi = static_cast<A>(std::numbers::pi);
  bool flipped = false;
  for (int i = 0; i < kMostHalfTurns && (angle > A(2) || angle < A(-2)); ++i) {
    angle += angle > A(0) ? -pi : pi;
    flipped = !flipped;
  }
  const A square = angle * angle;
  A sine = one;
  A cosine = one;
  // sin x = x (1 - x^2/(2 3) (1 - x^2/(4 5) (...))),  cos x = 1 - x^2/(1 2) (1 - x^2/(3 4) (...))
  for (int k = kTerms; k >= 1; --k) {
    sine = one - square * A(1.0 / ((2 * k) * (2 * k + 1))) * sine;
    cosine = one - square * A(1.0 / ((2 * k - 1) * (2 * k))) * cosine;
  }
  sine = angle * sine;
  return {typename N::Unit(flipped ? -sine : sine), typename N::Unit(flipped ? -cosine : cosine)};
}

struct ToolSpace;  ///< mm in the tool's own frame: centre of the cutting head, shaft along +y

/// How the tool is turned: takes a direction of its own frame to the world.
template <class N>
using Rotation = Transform<typename N::Unit, WorldSpace, ToolSpace>;

template <class N>
[[nodiscard]] constexpr Rotation<N> identity_rotation() noexcept {
  using U = typename N::Unit;
  return {{{{U(1), U(0), U(0)}, {U(0), U(1), U(0)}, {U(0), U(0), U(1)}}}};
}

/// Right-handed turn about the x axis.
template <class N>
[[nodiscard]] constexpr Rotation<N> rotation_x(typename N::Angle angle) noexcept {
  using U = typename N::Unit;
  const auto [s, c] = sine_cosine<N>(angle);
  return {{{{U(1), U(0), U(0)}, {U(0), c, -s}, {U(0), s, c}}}};
}

/// Right-handed turn about the y axis.
template <class N>
[[nodiscard]] constexpr Rotation<N> rotation_y(typename N::Angle angle) noexcept {
  using U = typename N::Unit;
  const auto [s, c] = sine_cosine<N>(angle);
  return {{{{c, U(0), s}, {U(0), U(1), U(0)}, {-s, U(0), c}}}};
}

/// First `b`, then `a`.
template <class N>
[[nodiscard]] constexpr Rotation<N> compose(const Rotation<N>& a, const Rotation<N>& b) noexcept {
  Rotation<N> product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      product.row[i][j] =
          a.row[i][0] * b.row[0][j] + a.row[i][1] * b.row[1][j] + a.row[i][2] * b.row[2][j];
    }
  }
  return product;
}

}  // namespace kerf
