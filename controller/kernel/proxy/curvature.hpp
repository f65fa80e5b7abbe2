// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "controller/kernel/proxy/constraint_plane.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_math.hpp"

namespace kerf {

/// How the solid curves around a tool in a bowl or a slot hardly wider than itself. The places that
/// its centre may take form a hollow; over a step `moved` the normal turns by (across . moved) /
/// radius along `across`. Radius 0: no bowl, or not known.
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
/// of 0.2. What a wandering hand has milled is a bowl along both directions of the plane, so two
/// curves are kept.
template <class N>
class CurvatureEstimate {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  using Place = ContactVec<Real>;
  using Turn = ContactVec<Unit>;  ///< of a normal: far less than a unit

 public:
  /// Learns from the deepest planes of two places, the second `moved` from the first. Unlike planes
  /// are two walls, or one is the head's and one the shaft's: all is forgotten. Normals that part
  /// are a bump: its steps only fall short, and stay as they are.
  constexpr void learn(const Contacts<N>& before, const Contacts<N>& after, Place moved) noexcept {
    constexpr double kTelling = 0.01;  // units: over less noise turns a normal as much
    if (before.count == 0 || after.count == 0) return forget();
    if (before.plane[0].behind != after.plane[0].behind) return forget();
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

  /// At the end of a tick: forgets what the noise of normals may have feigned. Else it would
  /// shorten steps until none is tried, and nothing new is learned.
  constexpr void forget_noise() noexcept {
    if (turn_ < Unit(kNoise)) forget();
  }

  /// Newton's step with this curvature: `step`, shortened so that it ends where the load presses
  /// straight.
  [[nodiscard]] constexpr Place eased(Place step, Real load) const noexcept {
    if (!first_.known() || load <= Real(0)) return step;
    const Unit p = share<N>(load, load + first_.radius);
    const Real a = along<N>(first_.across, step);
    if (!second_.known()) return step - times<N>(first_.across, multiply<Real>(p, a));
    const Unit q = share<N>(load, load + second_.radius);
    const Real b = along<N>(second_.across, step);
    const Unit mixed = dot(first_.across, second_.across);
    const Real whole(Unit(1) - mixed * p * (mixed * q));
    if (whole < Real(0.02)) return step - times<N>(second_.across, multiply<Real>(q, b));
    const Real one = multiply<Real>(p, a - multiply<Real>(mixed * q, b)) / whole;
    const Real two = multiply<Real>(q, b - multiply<Real>(mixed * p, a)) / whole;
    return step - times<N>(first_.across, one) - times<N>(second_.across, two);
  }

 private:
  /// What noise turns a normal by, as a deviation, in the noisiest scan that no filter smooths
  /// (docs/theory.md 4.4). If smaller turns were remembered, too, the force of a ball would step by
  /// 27 % over a sharp edge, not by 2 (rows `edges`). With 0.03 a ball bores 1.06 % more beside its
  /// shaft than without one (tests/servo/shaft_test.cpp).
  static constexpr double kNoise = 0.02;  ///< rad
  static constexpr double kSkew =
      0.3;  ///< least cosine to the step at which the rest of a turn counts

  constexpr void forget() noexcept {
    first_ = second_ = last_ = {};
    turn_ = {};
  }

  static constexpr Curve<N> curve_of(Turn turned, Place moved, Real least) noexcept {
    const Turn across = direction_of_turn<N>(turned);
    const Real closing = along<N>(across, moved);
    if (closing <= least) return {};
    return {across, quotient<N>(closing, norm(turned))};
  }
  /// At most a radian.
  static constexpr Turn turn_of_normal(const Curve<N>& curve, Place moved) noexcept {
    const Real step = std::clamp(along<N>(curve.across, moved), -curve.radius, curve.radius);
    const Unit turn = share<N>(step, curve.radius);
    return {curve.across.x * turn, curve.across.y * turn, curve.across.z * turn};
  }

  Curve<N> first_, second_;  ///< of the estimate
  Curve<N> last_;            ///< of the last step alone
  Unit turn_{};              ///< of the normal over it
};

}  // namespace kerf
