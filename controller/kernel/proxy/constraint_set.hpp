// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/contact_math.hpp"

namespace kerf {

/// The planes that hold the tool. Their depths count from where its centre is now.
template <class N>
struct ConstraintSet {
  std::size_t count = 0;
  std::array<ConstraintPlane<N>, kMaxPlanes> plane{};
};

/// Where a tool goes that is asked to move: `move` = displacement + SUM load_i normal_i.
template <class N>
struct Slide {
  ContactVec<typename N::Real> move{};
  std::array<typename N::Real, kMaxPlanes> load{};  ///< how hard each plane is pressed, units
};

/// The loads of two or three planes that are all touched, by Cramer's rule. For each plane i SUM_j
/// c_ij load_j = need_i: c_ij is the product of two normals (c_ii = 1), need_i how far plane i
/// wants the tool out. False where the normals nearly lie on one line or in one plane: a
/// determinant below kLeastDeterminant.
template <class N>
class Loads {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  /// |cofactor| <= 2. Q29 leaves room for the sum of three products with a Real: 3 * 2^61.
  using Cofactor = std::conditional_t<N::kIsFixed, Fixed<29>, Unit>;

 public:
  using Needs = std::array<Real, kMaxPlanes>;
  using Products = std::array<std::array<Unit, kMaxPlanes>, kMaxPlanes>;

  [[nodiscard]] static constexpr bool of_pair(const Products& c, const Needs& need, std::size_t i,
                                              std::size_t j, Needs& load) noexcept {
    const Cofactor one(1), minus_c = -Cofactor(c[i][j]);
    const Cofactor determinant = one - multiply<Cofactor>(c[i][j], c[i][j]);
    if (determinant < Cofactor(kLeastDeterminant)) return false;
    load[i] = quotient({one, minus_c, {}}, {need[i], need[j], {}}, determinant);
    load[j] = quotient({minus_c, one, {}}, {need[i], need[j], {}}, determinant);
    return true;
  }

  [[nodiscard]] static constexpr bool of_three(const Products& c, const Needs& need,
                                               Needs& load) noexcept {
    const auto minor = [&](std::size_t i, std::size_t j, std::size_t k, std::size_t l) {
      return multiply<Cofactor>(c[i][j], c[k][l]) - multiply<Cofactor>(c[i][l], c[k][j]);
    };
    const Cofactor c00 = minor(1, 1, 2, 2), c11 = minor(0, 0, 2, 2), c22 = minor(0, 0, 1, 1);
    const Cofactor c01 = minor(1, 2, 2, 0), c02 = minor(1, 0, 2, 1), c12 = minor(0, 1, 2, 0);
    const Cofactor determinant =
        c00 + multiply<Cofactor>(c[0][1], c01) + multiply<Cofactor>(c[0][2], c02);
    if (determinant < Cofactor(kLeastDeterminant)) return false;
    load = {quotient({c00, c01, c02}, need, determinant),
            quotient({c01, c11, c12}, need, determinant),
            quotient({c02, c12, c22}, need, determinant)};
    return true;
  }

 private:
  /// cofactor . need / determinant. Fixed: Q45 over Q29, exact up to the quotient's last bit.
  [[nodiscard]] static constexpr Real quotient(const std::array<Cofactor, kMaxPlanes>& cofactor,
                                               const Needs& need, Cofactor determinant) noexcept {
    if constexpr (N::kIsFixed) {
      const std::int64_t sum = std::int64_t{cofactor[0].raw()} * need[0].raw() +
                               std::int64_t{cofactor[1].raw()} * need[1].raw() +
                               std::int64_t{cofactor[2].raw()} * need[2].raw();
      return Real::from_raw(saturate_i32(sum / determinant.raw()));
    } else {
      return (cofactor[0] * need[0] + cofactor[1] * need[1] + cofactor[2] * need[2]) / determinant;
    }
  }
};

/// The place nearest to `displacement` that all planes allow (docs/theory.md 4.3). Where planes
/// leave no place, as two walls of a slot without play, the oldest one is left out: it stands last.
///
/// |displacement| <= 16384 units. At most 8 + 4 + 2 sets. Fixed: within 4 steps of each plane where
/// the displacement is some units long.
template <class N>
[[nodiscard]] constexpr Slide<N> nearest(const ConstraintSet<N>& planes,
                                         ContactVec<typename N::Real> displacement) noexcept {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  constexpr auto kTouching = Real(1.0 / 16384);  // 4 steps of Q15.16
  typename Loads<N>::Products products{};
  typename Loads<N>::Needs need{};
  for (std::size_t i = 0; i < planes.count; ++i) {
    need[i] = planes.plane[i].depth - along<N>(planes.plane[i].normal, displacement);
    products[i][i] = Unit(1);
    for (std::size_t j = 0; j < i; ++j) {
      products[i][j] = products[j][i] = dot(planes.plane[i].normal, planes.plane[j].normal);
    }
  }
  for (std::size_t count = planes.count; count > 0; --count) {
    for (unsigned set = 0; set < 1U << count; ++set) {
      Slide<N> slide{displacement};
      if (set == 7) {
        if (!Loads<N>::of_three(products, need, slide.load)) continue;
      } else if (set != 0) {
        const auto first = static_cast<std::size_t>(std::countr_zero(set));
        const auto last = static_cast<std::size_t>(std::bit_width(set)) - 1;
        slide.load[first] = need[first];
        if (first != last && !Loads<N>::of_pair(products, need, first, last, slide.load)) continue;
      }
      bool allowed = true;
      for (std::size_t i = 0; i < count; ++i) {
        allowed = allowed && slide.load[i] >= Real(0);
        slide.move = slide.move + times<N>(planes.plane[i].normal, slide.load[i]);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const ConstraintPlane<N>& plane = planes.plane[i];
        allowed = allowed && along<N>(plane.normal, slide.move) >= plane.depth - kTouching;
      }
      if (allowed) return slide;
    }
  }
  return {displacement};
}

/// Two planes whose normals are nearer than this are one face, seen from two places. On a bump they
/// would feign a crease; in a hollow curvature.hpp tells better how it goes on between them. (With
/// 15 degrees a tool in a slot with a play of 0.1 units would rest at two places, up to 0.05 units
/// apart.) A face that the head meets and one that is met behind it are two.
inline constexpr double kFalseCreaseCosine = 0.7071067811865476;  // 45 degrees

template <class N>
[[nodiscard]] constexpr bool has_plane_like(const ConstraintSet<N>& planes,
                                            const ConstraintPlane<N>& plane) noexcept {
  for (std::size_t i = 0; i < planes.count; ++i) {
    const ConstraintPlane<N>& other = planes.plane[i];
    if (other.behind == plane.behind &&
        dot(other.normal, plane.normal) > typename N::Unit(kFalseCreaseCosine)) {
      return true;
    }
  }
  return false;
}

template <class N>
[[nodiscard]] constexpr ConstraintSet<N> constraints_of(const Contacts<N>& felt) noexcept {
  return {static_cast<std::size_t>(felt.count), felt.plane};
}

/// Adds `older` planes while there is room; their depths count from a place `moved` before this
/// one. Takes those that are unlike all others and not more than half a unit away.
template <class N>
constexpr void keep(ConstraintSet<N>& constraints, const ConstraintSet<N>& older,
                    ContactVec<typename N::Real> moved) noexcept {
  using Real = typename N::Real;
  for (std::size_t i = 0; i < older.count && constraints.count < kMaxPlanes; ++i) {
    ConstraintPlane<N> plane = older.plane[i];
    plane.depth = plane.depth - along<N>(plane.normal, moved);
    if (plane.depth > Real(-0.5) && !has_plane_like(constraints, plane))
      constraints.plane[constraints.count++] = plane;
  }
}

/// Learns from a place that turned out too deep, `displacement` ahead: adds those of its planes
/// that hold the tool already where it is, to 0.02 units. Returns whether there was one.
template <class N>
[[nodiscard]] constexpr bool learn(ConstraintSet<N>& constraints, const Contacts<N>& seen,
                                   ContactVec<typename N::Real> displacement) noexcept {
  using Real = typename N::Real;
  constexpr auto kNear = Real(0.02);
  const std::size_t before = constraints.count;
  for (std::size_t i = 0; i < static_cast<std::size_t>(seen.count); ++i) {
    ConstraintPlane<N> plane = seen.plane[i];
    if (constraints.count == kMaxPlanes || plane.depth < -kNear) break;
    plane.depth = plane.depth + along<N>(plane.normal, displacement);
    if (plane.depth < kNear && !has_plane_like(constraints, plane)) {
      constraints.plane[constraints.count++] = plane;
    }
  }
  return constraints.count > before;
}

}  // namespace kerf
