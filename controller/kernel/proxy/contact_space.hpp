// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// Contact space: its vectors and their products, and orientations as unit quaternions.

namespace kerf {

/// The space in which the swept contact is solved: axes and origin of the world; one unit is the
/// edge of the finest voxel of all solid volumes (docs/theory.md 1.2). docs/contact.md calls it a
/// voxel.
struct ContactSpace;

template <class S>
using ContactVec = Vec<S, ContactSpace>;

/// Limit of a tool's centre and of its goal on each axis, units. So a displacement stays within
/// 16384, where the products below have room.
inline constexpr std::int32_t kContactLimit = 8192;

/// Dot product of `v` and a unit normal. Fixed: each product is below 2^60, so the sum of three
/// fits 64 bits; it is rounded once.
template <class N>
[[nodiscard]] constexpr typename N::Real along(ContactVec<typename N::Unit> normal,
                                               ContactVec<typename N::Real> v) noexcept {
  if constexpr (N::kIsFixed) {
    const std::int64_t sum = std::int64_t{normal.x.raw()} * v.x.raw() +
                             std::int64_t{normal.y.raw()} * v.y.raw() +
                             std::int64_t{normal.z.raw()} * v.z.raw();
    return N::Real::from_wide(sum, N::Unit::kFractionBits + N::Real::kFractionBits);
  } else {
    return dot(normal, v);
  }
}

/// The vector of this length along a normal.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Real> times(ContactVec<typename N::Unit> normal,
                                                           typename N::Real length) noexcept {
  using Real = typename N::Real;
  return {multiply<Real>(normal.x, length), multiply<Real>(normal.y, length),
          multiply<Real>(normal.z, length)};
}

/// `factor` times a vector, |factor| <= 1.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Real> part_of(ContactVec<typename N::Real> v,
                                                             typename N::Unit factor) noexcept {
  using Real = typename N::Real;
  return {multiply<Real>(factor, v.x), multiply<Real>(factor, v.y), multiply<Real>(factor, v.z)};
}

/// part / whole, |part| <= whole, whole > 0. Fixed: rounds toward 0 at 2^-30.
template <class N>
[[nodiscard]] constexpr typename N::Unit fraction(typename N::Real part,
                                                  typename N::Real whole) noexcept {
  if constexpr (N::kIsFixed) {
    using Unit = typename N::Unit;
    const std::int64_t scaled = std::int64_t{part.raw()} * Unit(1).raw();
    return Unit::from_raw(static_cast<std::int32_t>(scaled / whole.raw()));
  } else {
    return part / whole;
  }
}

/// length / angle, `angle` > 0: the radius of an arc. Fixed: rounds toward 0, saturates.
template <class N>
[[nodiscard]] constexpr typename N::Real quotient(typename N::Real length,
                                                  typename N::Unit angle) noexcept {
  if constexpr (N::kIsFixed) {
    using Unit = typename N::Unit;
    const std::int64_t scaled = std::int64_t{length.raw()} * Unit(1).raw();
    return N::Real::from_raw(saturate_i32(scaled / angle.raw()));
  } else {
    return length / angle;
  }
}

/// The direction of a vector; 0 if it is shorter than 1e-4, some steps of Q15.16.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> direction_of(
    ContactVec<typename N::Real> v) noexcept {
  using Real = typename N::Real;
  const Real length = norm(v);
  if (length < Real(1e-4)) return {};
  return {fraction<N>(v.x, length), fraction<N>(v.y, length), fraction<N>(v.z, length)};
}

/// The direction of a small rotation; 0 below 1e-6.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> direction_of_turn(
    ContactVec<typename N::Unit> v) noexcept {
  using Unit = typename N::Unit;
  const Unit length = norm(v);
  if (length < Unit(1e-6)) return {};
  return {v.x / length, v.y / length, v.z / length};
}

/// Moment of a unit force along `direction` that acts at `lever`: a moment arm in units.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Real> moment(
    ContactVec<typename N::Real> lever, ContactVec<typename N::Unit> direction) noexcept {
  using Real = typename N::Real;
  const auto part = [](Real a, typename N::Unit p, Real b, typename N::Unit q) {
    return multiply<Real>(p, a) - multiply<Real>(q, b);
  };
  return {part(lever.y, direction.z, lever.z, direction.y),
          part(lever.z, direction.x, lever.x, direction.z),
          part(lever.x, direction.y, lever.y, direction.x)};
}

/// Orientation of a tool, from its own axes to those of the world: a unit quaternion.
template <class N>
struct Orientation {
  typename N::Unit x{}, y{}, z{}, w{1};

  friend constexpr bool operator==(const Orientation&, const Orientation&) noexcept = default;
};

/// Rows of a rotation matrix.
template <class N>
using RotationRows = std::array<std::array<typename N::Unit, 3>, 3>;

/// The rotation by `b`, then by `a`. Fixed: four roundings per component; a Newton step keeps the
/// length at 1 after any number of products.
template <class N>
[[nodiscard]] constexpr Orientation<N> compose(const Orientation<N>& a,
                                               const Orientation<N>& b) noexcept {
  using Unit = typename N::Unit;
  const Orientation<N> c{a.w * b.x + a.x * b.w + (a.y * b.z - a.z * b.y),
                         a.w * b.y + a.y * b.w + (a.z * b.x - a.x * b.z),
                         a.w * b.z + a.z * b.w + (a.x * b.y - a.y * b.x),
                         a.w * b.w - a.x * b.x - (a.y * b.y + a.z * b.z)};
  const Unit square = c.x * c.x + c.y * c.y + c.z * c.z + c.w * c.w;
  const Unit scale = Unit(1.5) - Unit(0.5) * square;
  return {scale * c.x, scale * c.y, scale * c.z, scale * c.w};
}

template <class N>
[[nodiscard]] constexpr Orientation<N> inverse(const Orientation<N>& orientation) noexcept {
  return {-orientation.x, -orientation.y, -orientation.z, orientation.w};
}

template <class N>
[[nodiscard]] constexpr RotationRows<N> rows_of(const Orientation<N>& t) noexcept {
  using Unit = typename N::Unit;
  const auto twice = [](Unit a) { return a + a; };
  const Unit xx = t.x * t.x, yy = t.y * t.y, zz = t.z * t.z;
  const Unit xy = t.x * t.y, xz = t.x * t.z, yz = t.y * t.z;
  const Unit wx = t.w * t.x, wy = t.w * t.y, wz = t.w * t.z;
  return {{{Unit(1) - twice(yy + zz), twice(xy - wz), twice(xz + wy)},
           {twice(xy + wz), Unit(1) - twice(xx + zz), twice(yz - wx)},
           {twice(xz - wy), twice(yz + wx), Unit(1) - twice(xx + yy)}}};
}

/// The quaternion of a rotation matrix, by the largest of the four components (Shepperd 1978),
/// which is at least 1/2, so that it never divides by a small number. The result for any other
/// matrix is an arbitrary quaternion, not an error.
template <class N>
[[nodiscard]] constexpr Orientation<N> orientation_of(const RotationRows<N>& rows) noexcept {
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
[[nodiscard]] constexpr typename N::Unit half_sine_between(const Orientation<N>& a,
                                                           const Orientation<N>& b) noexcept {
  const Orientation<N> rest = compose(a, inverse(b));
  return norm(ContactVec<typename N::Unit>{rest.x, rest.y, rest.z});
}

/// From `now` along the shorter arc towards `goal`, by at most twice the angle whose sine is
/// `half_sine` (0 to 1/2). Arrives exactly.
template <class N>
[[nodiscard]] constexpr Orientation<N> rotate_towards(const Orientation<N>& now,
                                                      const Orientation<N>& goal,
                                                      typename N::Unit half_sine) noexcept {
  using Unit = typename N::Unit;
  const Orientation<N> rest = compose(goal, inverse(now));
  const ContactVec<Unit> axis{rest.x, rest.y, rest.z};
  const Unit length = norm(axis);
  if (length <= half_sine) return goal;
  const Unit share = (rest.w < Unit(0) ? -half_sine : half_sine) / length;
  const Orientation<N> step{share * rest.x, share * rest.y, share * rest.z,
                            square_root(Unit(1) - half_sine * half_sine)};
  return compose(step, now);
}

}  // namespace kerf
