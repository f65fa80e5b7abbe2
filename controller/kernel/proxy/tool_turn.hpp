// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

/// Orientation of a tool, from its own axes to those of the world: a unit quaternion.
template <class N>
struct ToolTurn {
  typename N::Unit x{}, y{}, z{}, w{1};

  friend constexpr bool operator==(const ToolTurn&, const ToolTurn&) noexcept = default;
};

/// Rows of a rotation matrix.
template <class N>
using TurnRows = std::array<std::array<typename N::Unit, 3>, 3>;

/// First `b`, then `a`. Fixed: four roundings a component; a step of Newton's method keeps the
/// length at 1, whatever the number of products.
template <class N>
[[nodiscard]] constexpr ToolTurn<N> compose(const ToolTurn<N>& a, const ToolTurn<N>& b) noexcept {
  using Unit = typename N::Unit;
  const ToolTurn<N> c{a.w * b.x + a.x * b.w + (a.y * b.z - a.z * b.y),
                      a.w * b.y + a.y * b.w + (a.z * b.x - a.x * b.z),
                      a.w * b.z + a.z * b.w + (a.x * b.y - a.y * b.x),
                      a.w * b.w - a.x * b.x - (a.y * b.y + a.z * b.z)};
  const Unit square = c.x * c.x + c.y * c.y + c.z * c.z + c.w * c.w;
  const Unit scale = Unit(1.5) - Unit(0.5) * square;
  return {scale * c.x, scale * c.y, scale * c.z, scale * c.w};
}

template <class N>
[[nodiscard]] constexpr ToolTurn<N> inverse(const ToolTurn<N>& turn) noexcept {
  return {-turn.x, -turn.y, -turn.z, turn.w};
}

template <class N>
[[nodiscard]] constexpr TurnRows<N> rows_of(const ToolTurn<N>& t) noexcept {
  using Unit = typename N::Unit;
  const auto twice = [](Unit a) { return a + a; };
  const Unit xx = t.x * t.x, yy = t.y * t.y, zz = t.z * t.z;
  const Unit xy = t.x * t.y, xz = t.x * t.z, yz = t.y * t.z;
  const Unit wx = t.w * t.x, wy = t.w * t.y, wz = t.w * t.z;
  return {{{Unit(1) - twice(yy + zz), twice(xy - wz), twice(xz + wy)},
           {twice(xy + wz), Unit(1) - twice(xx + zz), twice(yz - wx)},
           {twice(xz - wy), twice(yz + wx), Unit(1) - twice(xx + yy)}}};
}

/// The turn of a rotation matrix, by the largest of the four components (Shepperd 1978), which is
/// at least 1/2: no division by little. A matrix that is none gives some quaternion, and no fault.
template <class N>
[[nodiscard]] constexpr ToolTurn<N> turn_of(const TurnRows<N>& rows) noexcept {
  using Unit = typename N::Unit;
  constexpr Unit kQuarter(0.25);
  const auto at = [&](std::size_t i, std::size_t j) { return kQuarter * rows[i][j]; };
  // Squares of the components: (1 +- m00 +- m11 +- m22) / 4.
  const Unit xx = kQuarter + at(0, 0) - at(1, 1) - at(2, 2);
  const Unit yy = kQuarter - at(0, 0) + at(1, 1) - at(2, 2);
  const Unit zz = kQuarter - at(0, 0) - at(1, 1) + at(2, 2);
  const Unit ww = kQuarter + at(0, 0) + at(1, 1) + at(2, 2);
  const Unit wx = at(2, 1) - at(1, 2), wy = at(0, 2) - at(2, 0), wz = at(1, 0) - at(0, 1);
  const Unit xy = at(1, 0) + at(0, 1), xz = at(0, 2) + at(2, 0), yz = at(2, 1) + at(1, 2);
  if (ww >= xx && ww >= yy && ww >= zz) {
    const Unit w = square_root(ww);
    return {wx / w, wy / w, wz / w, w};
  }
  if (xx >= yy && xx >= zz) {
    const Unit x = square_root(xx);
    return {x, xy / x, xz / x, wx / x};
  }
  if (yy >= zz) {
    const Unit y = square_root(yy);
    return {xy / y, y, yz / y, wy / y};
  }
  const Unit z = square_root(zz);
  return {xz / z, yz / z, z, wz / z};
}

/// Sine of half the angle between two orientations; 0 to 1.
template <class N>
[[nodiscard]] constexpr typename N::Unit half_sine_between(const ToolTurn<N>& a,
                                                           const ToolTurn<N>& b) noexcept {
  const ToolTurn<N> rest = compose(a, inverse(b));
  return norm(ContactVec<typename N::Unit>{rest.x, rest.y, rest.z});
}

/// From `now` along the shorter arc towards `goal`, by at most twice the angle whose sine is
/// `half_sine` (0 to 1/2). Arrives exactly.
template <class N>
[[nodiscard]] constexpr ToolTurn<N> turned_towards(const ToolTurn<N>& now, const ToolTurn<N>& goal,
                                                   typename N::Unit half_sine) noexcept {
  using Unit = typename N::Unit;
  const ToolTurn<N> rest = compose(goal, inverse(now));
  const ContactVec<Unit> axis{rest.x, rest.y, rest.z};
  const Unit length = norm(axis);
  if (length <= half_sine) return goal;
  const Unit share = (rest.w < Unit(0) ? -half_sine : half_sine) / length;
  const ToolTurn<N> step{share * rest.x, share * rest.y, share * rest.z,
                         square_root(Unit(1) - half_sine * half_sine)};
  return compose(step, now);
}

}  // namespace kerf
