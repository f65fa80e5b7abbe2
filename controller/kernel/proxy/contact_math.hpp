// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

/// No centre of a tool and no goal lies farther out on any axis, in units. So a displacement stays
/// within 16384, where the products below have room.
inline constexpr std::int32_t kContactLimit = 8192;

/// The part of `v` along a normal. Fixed: each product is below 2^60, so that three fit; one
/// rounding.
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
[[nodiscard]] constexpr typename N::Unit share(typename N::Real part,
                                               typename N::Real whole) noexcept {
  if constexpr (N::kIsFixed) {
    using Unit = typename N::Unit;
    const std::int64_t scaled = std::int64_t{part.raw()} * Unit(1).raw();
    return Unit::from_raw(static_cast<std::int32_t>(scaled / whole.raw()));
  } else {
    return part / whole;
  }
}

/// length / turn, turn > 0: the radius of an arc. Fixed: rounds toward 0, saturates.
template <class N>
[[nodiscard]] constexpr typename N::Real quotient(typename N::Real length,
                                                  typename N::Unit turn) noexcept {
  if constexpr (N::kIsFixed) {
    using Unit = typename N::Unit;
    const std::int64_t scaled = std::int64_t{length.raw()} * Unit(1).raw();
    return N::Real::from_raw(saturate_i32(scaled / turn.raw()));
  } else {
    return length / turn;
  }
}

/// The direction of a vector; 0 where it is shorter than 1e-4, some steps of Q15.16.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> direction_of(
    ContactVec<typename N::Real> v) noexcept {
  using Real = typename N::Real;
  const Real length = norm(v);
  if (length < Real(1e-4)) return {};
  return {share<N>(v.x, length), share<N>(v.y, length), share<N>(v.z, length)};
}

/// The direction of a small turn; 0 below 1e-6.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> direction_of_turn(
    ContactVec<typename N::Unit> v) noexcept {
  using Unit = typename N::Unit;
  const Unit length = norm(v);
  if (length < Unit(1e-6)) return {};
  return {v.x / length, v.y / length, v.z / length};
}

/// Moment of a unit force along `direction` that acts at `arm`: a moment arm in units.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Real> moment(
    ContactVec<typename N::Real> arm, ContactVec<typename N::Unit> direction) noexcept {
  using Real = typename N::Real;
  const auto part = [](Real a, typename N::Unit p, Real b, typename N::Unit q) {
    return multiply<Real>(p, a) - multiply<Real>(q, b);
  };
  return {part(arm.y, direction.z, arm.z, direction.y),
          part(arm.z, direction.x, arm.x, direction.z),
          part(arm.x, direction.y, arm.y, direction.x)};
}

}  // namespace kerf
