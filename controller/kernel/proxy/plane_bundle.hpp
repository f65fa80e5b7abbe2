// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/kernel/proxy/plane.hpp"

namespace kerf {

/// The planes that hold the tool, their depths counted from where its centre is now.
template <class N>
struct PlaneBundle {
  std::size_t count = 0;
  std::array<Plane<N>, kMaxPlanes> plane{};
};

/// Where a tool goes that is asked to move by `way`: `move = way + SUM load_i normal_i`.
template <class N>
struct Slide {
  ContactVec<typename N::Real> move{};
  std::array<typename N::Real, kMaxPlanes> load{};  ///< how hard each plane is pressed, units
};

/// Pair products of the normals of an active set and its loads by Cramer's rule. A plane outside of
/// the set has a row of the unit matrix and a need of 0, so one text solves every set.
template <class N>
class ActiveSet {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  /// |cofactor| <= 2. Q29 leaves room for the sum of three products with a Real: 3 * 2^61.
  using Cofactor = std::conditional_t<N::kIsFixed, Fixed<29>, Unit>;
  template <class S>
  using Matrix = std::array<std::array<S, kMaxPlanes>, kMaxPlanes>;

 public:
  constexpr ActiveSet(const Matrix<Unit>& products, const std::array<Real, kMaxPlanes>& need,
                      unsigned set) noexcept {
    for (std::size_t i = 0; i < kMaxPlanes; ++i) {
      for (std::size_t j = 0; j < kMaxPlanes; ++j) {
        const bool both = (set >> i & 1U) != 0 && (set >> j & 1U) != 0;
        gram_[i][j] = i == j ? Unit(1) : both ? products[i][j] : Unit(0);
      }
      need_[i] = (set >> i & 1U) != 0 ? need[i] : Real(0);
    }
  }

  /// False where the normals are too near to one plane or line: a determinant below 1e-3.
  [[nodiscard]] constexpr bool solve(std::array<Real, kMaxPlanes>& load) const noexcept {
    Matrix<Cofactor> cofactor{};
    for (std::size_t i = 0; i < kMaxPlanes; ++i) {
      for (std::size_t j = 0; j < kMaxPlanes; ++j) {
        const std::size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        cofactor[i][j] = multiply<Cofactor>(gram_[i1][j1], gram_[i2][j2]) -
                         multiply<Cofactor>(gram_[i1][j2], gram_[i2][j1]);
      }
    }
    const Cofactor determinant = multiply<Cofactor>(gram_[0][0], cofactor[0][0]) +
                                 multiply<Cofactor>(gram_[0][1], cofactor[0][1]) +
                                 multiply<Cofactor>(gram_[0][2], cofactor[0][2]);
    if (determinant < Cofactor(1e-3)) return false;
    for (std::size_t i = 0; i < kMaxPlanes; ++i) load[i] = quotient(cofactor[i], determinant);
    return true;
  }

 private:
  /// cofactor . need / determinant. Fixed: Q45 over Q29, exact up to the quotient's last bit.
  [[nodiscard]] constexpr Real quotient(const std::array<Cofactor, kMaxPlanes>& cofactor,
                                        Cofactor determinant) const noexcept {
    if constexpr (N::kIsFixed) {
      const std::int64_t sum = std::int64_t{cofactor[0].raw()} * need_[0].raw() +
                               std::int64_t{cofactor[1].raw()} * need_[1].raw() +
                               std::int64_t{cofactor[2].raw()} * need_[2].raw();
      return Real::from_raw(saturate_i32(sum / determinant.raw()));
    } else {
      return (cofactor[0] * need_[0] + cofactor[1] * need_[1] + cofactor[2] * need_[2]) /
             determinant;
    }
  }

  Matrix<Unit> gram_{};
  std::array<Real, kMaxPlanes> need_{};
};

/// The nearest place to `way` that all planes allow, found as the one active set whose loads push
/// and whose place holds every plane. Stays where it is when no place is found: planes that leave
/// none, or nearly parallel ones.
///
/// Any |way| of 16384 units at most. At most eight sets; fixed: within 4 steps of each plane for a
/// way of some units.
template <class N>
[[nodiscard]] constexpr Slide<N> nearest(const PlaneBundle<N>& planes,
                                         ContactVec<typename N::Real> way) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  constexpr auto kTouching = Real(1.0 / 16384);  // 4 steps of Q15.16
  std::array<std::array<Unit, kMaxPlanes>, kMaxPlanes> products{};
  std::array<Real, kMaxPlanes> need{};
  for (std::size_t i = 0; i < planes.count; ++i) {
    need[i] = planes.plane[i].depth - along<N>(planes.plane[i].normal, way);
    for (std::size_t j = 0; j < i; ++j) {
      products[i][j] = products[j][i] = dot(planes.plane[i].normal, planes.plane[j].normal);
    }
  }
  for (unsigned set = 0; set < 1U << planes.count; ++set) {
    Slide<N> slide{way};
    if (set != 0 && !ActiveSet<N>(products, need, set).solve(slide.load)) continue;
    bool allowed = true;
    for (std::size_t i = 0; i < planes.count; ++i) {
      allowed = allowed && slide.load[i] >= Real(0);
      slide.move = slide.move + times<N>(planes.plane[i].normal, slide.load[i]);
    }
    for (std::size_t i = 0; i < planes.count; ++i) {
      const Plane<N>& plane = planes.plane[i];
      allowed = allowed && along<N>(plane.normal, slide.move) >= plane.depth - kTouching;
    }
    if (allowed) return slide;
  }
  return {};
}

/// Planes closer than this are one: two places on a smooth curve look like a crease.
inline constexpr double kFalseCreaseCosine = 0.9659258262890683;  // 15 degrees

template <class N>
[[nodiscard]] constexpr bool has_plane_like(const PlaneBundle<N>& planes,
                                            ContactVec<typename N::Unit> normal) noexcept {
  for (std::size_t i = 0; i < planes.count; ++i) {
    if (dot(planes.plane[i].normal, normal) > typename N::Unit(kFalseCreaseCosine)) return true;
  }
  return false;
}

template <class N>
[[nodiscard]] constexpr PlaneBundle<N> bundle_of(const Probe<N>& probe) noexcept {
  return {static_cast<std::size_t>(probe.count), probe.plane};
}

/// The planes of the newest place; then those of the place `moved` before while there is room, if
/// they are unlike and still near: between 0.5 units out of reach and 0.3 units deep.
template <class N>
[[nodiscard]] constexpr PlaneBundle<N> merged(const Probe<N>& newest, const PlaneBundle<N>& older,
                                              ContactVec<typename N::Real> moved) noexcept {
  using Real = typename N::Real;
  PlaneBundle<N> bundle = bundle_of(newest);
  for (std::size_t i = 0; i < older.count && bundle.count < kMaxPlanes; ++i) {
    Plane<N> plane = older.plane[i];
    plane.depth = plane.depth - along<N>(plane.normal, moved);
    const bool near = plane.depth > Real(-0.5) && plane.depth < Real(0.3);
    if (near && !has_plane_like(bundle, plane.normal)) bundle.plane[bundle.count++] = plane;
  }
  return bundle;
}

/// Adds those planes of a place that turned out too deep which hold the tool already where it is,
/// `way` before: within 0.02 units. Returns whether there was one.
template <class N>
[[nodiscard]] constexpr bool learn(PlaneBundle<N>& bundle, const Probe<N>& seen,
                                   ContactVec<typename N::Real> way) noexcept {
  using Real = typename N::Real;
  constexpr auto kNear = Real(0.02);
  const std::size_t before = bundle.count;
  for (std::size_t i = 0; i < static_cast<std::size_t>(seen.count); ++i) {
    Plane<N> plane = seen.plane[i];
    if (bundle.count == kMaxPlanes || plane.depth < -kNear) break;
    plane.depth = plane.depth + along<N>(plane.normal, way);
    if (plane.depth < kNear && !has_plane_like(bundle, plane.normal)) {
      bundle.plane[bundle.count++] = plane;
    }
  }
  return bundle.count > before;
}

}  // namespace kerf
