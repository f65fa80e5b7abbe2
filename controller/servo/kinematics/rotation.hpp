// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "controller/servo/kinematics/trigonometry.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

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
