// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "controller/kernel/proxy/contact_space.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// Constraint planes, the nearest position that they allow, and an estimate of the solid's
// curvature.

namespace kerf {

/// Most planes that hold the tool at one position: a face, a crease, a corner.
inline constexpr std::size_t kMaxPlanes = 3;

/// A contact allows the centre, now at q, to be at any x with `dot(normal, x - q) >= depth`
/// (docs/theory.md 4.3).
template <class N>
struct ConstraintPlane {
  ContactVec<typename N::Unit> normal{};  ///< out of the solid, length 1
  typename N::Real depth{};               ///< units; above 0: the tool is in too deep
  ContactVec<typename N::Real> lever{};   ///< from the tool's centre to the contact, units
  bool on_shaft = false;                  ///< met by shaft or handpiece (contact_query.hpp)

  friend constexpr bool operator==(const ConstraintPlane&,
                                   const ConstraintPlane&) noexcept = default;
};

/// Least determinant of planes that are solved for together: 1 - c^2 of two, c the product of their
/// normals. Below it they nearly lie on one line, or three in one plane.
inline constexpr double kLeastDeterminant = 1e-3;

/// Whether planes of two volumes are one, as of a face that both share: their normals lie
/// within 1.8 degrees, so that their loads cannot be separated, and the deeper one alone holds the
/// tool. Both would take two of three slots and, as they cannot be solved for together, displace
/// the third.
template <class N>
[[nodiscard]] constexpr bool are_one_face(ContactVec<typename N::Unit> a,
                                          ContactVec<typename N::Unit> b) noexcept {
  using Unit = typename N::Unit;
  const Unit cosine = dot(a, b);
  return cosine > Unit(0) && Unit(1) - cosine * cosine < Unit(kLeastDeterminant);
}

/// The result of one collision query: `count` planes, the deepest first.
template <class N>
struct Contacts {
  typename N::Real depth{-1};  ///< the largest of the planes' depths; -1 if nothing is near
  std::int32_t count = 0;
  std::array<ConstraintPlane<N>, kMaxPlanes> plane{};
  bool no_normal = false;  ///< full density all round, or not queried: no normal, no plane

  friend constexpr bool operator==(const Contacts&, const Contacts&) noexcept = default;
};

/// Inserts a plane by its depth. Of planes of one face, met by the same part, and of more than
/// kMaxPlanes the deepest stay.
template <class N>
constexpr void insert(Contacts<N>& contacts, const ConstraintPlane<N>& plane) noexcept {
  const auto count = static_cast<std::size_t>(contacts.count);
  const auto says_the_same = [&](const ConstraintPlane<N>& other) {
    return other.on_shaft == plane.on_shaft && are_one_face<N>(other.normal, plane.normal);
  };
  std::size_t slot = 0;  // for the plane, in place of one of the same face or a shallower one
  while (slot < count && !says_the_same(contacts.plane[slot])) ++slot;
  if (slot == kMaxPlanes) --slot;
  if (slot < count && contacts.plane[slot].depth >= plane.depth) return;
  if (slot == count) ++contacts.count;
  for (; slot > 0 && contacts.plane[slot - 1].depth < plane.depth; --slot) {
    contacts.plane[slot] = contacts.plane[slot - 1];
  }
  contacts.plane[slot] = plane;
}

/// The planes that hold the tool. Depths are relative to the current position of its centre.
template <class N>
struct ConstraintSet {
  std::size_t count = 0;
  std::array<ConstraintPlane<N>, kMaxPlanes> plane{};
};

/// The allowed part of a displacement: `move` = displacement + SUM load_i normal_i.
template <class N>
struct ConstrainedMove {
  ContactVec<typename N::Real> move{};
  std::array<typename N::Real, kMaxPlanes> load{};  ///< of each plane, units
};

/// The loads of two or three planes that are all touched, by Cramer's rule. For each plane i SUM_j
/// c_ij load_j = need_i: c_ij is the product of two normals (c_ii = 1), need_i how far plane i
/// has to move the tool out. False if the normals nearly lie on one line or in one plane: a
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

/// The position nearest to `displacement` that all planes allow (docs/theory.md 4.3). If they allow
/// none, as two walls of a slot without play, the oldest one is left out: it stands last.
///
/// |displacement| <= 16384 units. At most 8 + 4 + 2 sets. Fixed: within 4 steps of each plane if
/// the displacement is some units long.
template <class N>
[[nodiscard]] constexpr ConstrainedMove<N> constrained_move(
    const ConstraintSet<N>& planes, ContactVec<typename N::Real> displacement) noexcept {
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
      ConstrainedMove<N> slide{displacement};
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

/// Two planes whose normals are closer than this are one face, met at two positions. On a bump they
/// would act as a crease; in a hollow the curvature estimate describes the surface between them
/// better. (With 15 degrees a tool in a slot with a play of 0.1 units would rest at two positions,
/// up to 0.05 units apart.) A plane of the head and one of the shaft are always two.
inline constexpr double kFalseCreaseCosine = 0.7071067811865476;  // 45 degrees

template <class N>
[[nodiscard]] constexpr bool has_plane_like(const ConstraintSet<N>& planes,
                                            const ConstraintPlane<N>& plane) noexcept {
  for (std::size_t i = 0; i < planes.count; ++i) {
    const ConstraintPlane<N>& other = planes.plane[i];
    if (other.on_shaft == plane.on_shaft &&
        dot(other.normal, plane.normal) > typename N::Unit(kFalseCreaseCosine)) {
      return true;
    }
  }
  return false;
}

template <class N>
[[nodiscard]] constexpr ConstraintSet<N> constraints_of(const Contacts<N>& contacts) noexcept {
  return {static_cast<std::size_t>(contacts.count), contacts.plane};
}

/// Adds `older` planes while there is room; their depths are relative to a position `moved` before
/// this one. Takes those that are unlike all others and at most half a unit away.
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

/// Adds constraint planes found at a rejected trial position, `displacement` from here: those that
/// the trial reaches or violates and that the current position satisfies, each within 0.02 units.
/// Returns whether one was added.
template <class N>
[[nodiscard]] constexpr bool add_blocking_planes(
    ConstraintSet<N>& constraints, const Contacts<N>& seen,
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

/// Curvature of the solid around a tool in a bowl or a slot hardly wider than itself. The positions
/// that its centre may take form a hollow; over a step `moved` the normal rotates by
/// (across . moved) / radius along `across`. Radius 0: no bowl, or unknown.
template <class N>
struct Curve {
  ContactVec<typename N::Unit> across{};
  typename N::Real radius{};  ///< units

  [[nodiscard]] constexpr bool known() const noexcept { return radius > typename N::Real(0); }
};

/// The curvature along the last two steps: a symmetric rank-one estimate with a memory of two
/// (docs/theory.md 4.4; Nocedal and Wright 2006, section 6.2).
///
/// Without it a slot with a play of a tenth of a unit turns a step of the hand of 0.01 into a swing
/// of 0.2. A wandering hand mills a bowl along both directions of the plane, so two curves are
/// kept.
template <class N>
class CurvatureEstimate {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  using Position = ContactVec<Real>;
  using Turn = ContactVec<Unit>;  ///< rotation of a normal: its change, far less than 1

 public:
  /// Updates the estimate from the deepest planes of two positions, the second `moved` from the
  /// first. If the normals differ by more than 45 degrees, or one plane was met by the head and the
  /// other by the shaft, these are two walls: the estimate is reset. On a convex surface no
  /// curvature is stored, because uncorrected steps there are only too short.
  constexpr void learn(const Contacts<N>& before, const Contacts<N>& after,
                       Position moved) noexcept {
    constexpr double kTelling = 0.01;  // units: over less, noise rotates a normal as much
    if (before.count == 0 || after.count == 0) return forget();
    if (before.plane[0].on_shaft != after.plane[0].on_shaft) return forget();
    const auto& from = before.plane[0].normal;
    const auto& to = after.plane[0].normal;
    if (dot(from, to) < Unit(kFalseCreaseCosine)) return forget();
    const Real length = norm(moved);
    if (length < Real(kTelling)) return;
    const Turn turned = from - to;
    turn_ = norm(turned);
    const Curve<N> whole = curve_of(turned, moved, Real(0));
    const Curve<N> rest = last_.known() ? curve_of(turned - turn_of_normal(last_, moved), moved,
                                                   multiply<Real>(Unit(kSkew), length))
                                        : Curve<N>{};
    first_ = rest.known() ? last_ : whole;
    second_ = rest;
    last_ = whole;
  }

  /// At the end of a tick: forgets a curvature that may be noise of the normals. Else it would
  /// shorten steps until none is tried, and nothing new is learned.
  constexpr void forget_noise() noexcept {
    if (turn_ < Unit(kNoise)) forget();
  }

  /// Newton step with the estimated curvature: `step`, reduced so that at its end the load is along
  /// the surface normal.
  [[nodiscard]] constexpr Position eased(Position step, Real load) const noexcept {
    if (!first_.known() || load <= Real(0)) return step;
    const Unit p = fraction<N>(load, load + first_.radius);
    const Real a = along<N>(first_.across, step);
    if (!second_.known()) return step - times<N>(first_.across, multiply<Real>(p, a));
    const Unit q = fraction<N>(load, load + second_.radius);
    const Real b = along<N>(second_.across, step);
    const Unit mixed = dot(first_.across, second_.across);
    const Real whole(Unit(1) - mixed * p * (mixed * q));
    if (whole < Real(0.02)) return step - times<N>(second_.across, multiply<Real>(q, b));
    const Real one = multiply<Real>(p, a - multiply<Real>(mixed * q, b)) / whole;
    const Real two = multiply<Real>(q, b - multiply<Real>(mixed * p, a)) / whole;
    return step - times<N>(first_.across, one) - times<N>(second_.across, two);
  }

 private:
  /// Rotation of a normal by noise, as a deviation, in the noisiest scan without a filter
  /// (docs/theory.md 4.4). If smaller rotations were remembered, too, the force of a ball would
  /// step by 27 % over a sharp edge, not by 2 (rows `edges`). With 0.03 a ball bores 1.06 % more
  /// beside its shaft than without one (tests/servo/shaft_test.cpp).
  static constexpr double kNoise = 0.02;  ///< rad
  static constexpr double kSkew =
      0.3;  ///< least cosine to the step at which the rest of an arc counts

  constexpr void forget() noexcept {
    first_ = second_ = last_ = {};
    turn_ = {};
  }

  static constexpr Curve<N> curve_of(Turn turned, Position moved, Real least) noexcept {
    const Turn across = direction_of_turn<N>(turned);
    const Real closing = along<N>(across, moved);
    if (closing <= least) return {};
    return {across, quotient<N>(closing, norm(turned))};
  }
  /// At most a radian.
  static constexpr Turn turn_of_normal(const Curve<N>& curve, Position moved) noexcept {
    const Real step = std::clamp(along<N>(curve.across, moved), -curve.radius, curve.radius);
    const Unit angle = fraction<N>(step, curve.radius);
    return {curve.across.x * angle, curve.across.y * angle, curve.across.z * angle};
  }

  Curve<N> first_, second_;  ///< of the estimate
  Curve<N> last_;            ///< of the last step alone
  Unit turn_{};              ///< rotation of the normal over the last step
};

}  // namespace kerf
