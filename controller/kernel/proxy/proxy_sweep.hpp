// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>

#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_space.hpp"

namespace kerf {

/// The queries that the sweep needs of tool and volumes.
///
///   query(q)          contacts of the tool with its centre at q
///   free_distance(q, m)  how far the centre may go from q along m without contact: a lower
///                     bound, at most |m|; 0 if unknown
///   orient(o)         sets the orientation of the tool for all queries from now on
///   is_solid(q)       whether the position is in the solid
///   half_spent()      whether half of the tick's work is spent: the rest is kept for the move
///   may_query()       whether the tick's work allows another query
///   deficit()         units that the tool's surface reaches beyond its samples, at most
template <class F, class N>
concept ContactField = requires(F field, ContactVec<typename N::Real> q,
                                Orientation<N> orientation) {
  { field.query(q) } -> std::convertible_to<Contacts<N>>;
  { field.free_distance(q, q) } -> std::convertible_to<typename N::Real>;
  field.orient(orientation);
  { field.is_solid(q) } -> std::convertible_to<bool>;
  { field.half_spent() } -> std::convertible_to<bool>;
  { field.may_query() } -> std::convertible_to<bool>;
  { field.deficit() } -> std::convertible_to<typename N::Real>;
};

/// Constants of the sweep (docs/theory.md 4.2 and after); lengths in units of contact space.
struct SweepRules {
  static constexpr std::int32_t kMaxQueries = 32;
  /// No rotation begins after this many queries, pushes included; the rest is kept for the move.
  static constexpr std::int32_t kMaxRotationQueries = 12;
  static constexpr double kTolerance = 0.01;  ///< a position this deep is allowed
  /// Allowed depth after a rotation. It leaves the move some play; otherwise an inverted cone with
  /// a shaft stops between plates (rows `traps`, --seed 15590).
  static constexpr double kTurnTolerance = 0.005;
  static constexpr double kArrived = 0.004;  ///< shorter displacements are not tried
  /// A smaller load of all planes together bears nothing: the tool is at its goal then.
  static constexpr double kLeastLoad = 0.001;
  /// Longest displacement of any sample between two queries. The middle of the thinnest wall, 2
  /// units, is one unit deep: beyond it density falls again, and its gradient leads onward.
  static constexpr double kStep = 0.875;
  /// A step this much nearer to the goal is kept. Without it the force steps by 2.1 instead of 1.2
  /// % at the worst position of a noisy valley (tests/servo/force_cut_test.cpp).
  static constexpr double kGain = 0.001;
  static constexpr double kResidual = 0.8;  ///< fraction of the displacement that a step may leave
  /// A next step shorter than this fraction of a failed one is not shortened. Without it the force
  /// of `cutting, milling into the GE tooth, 16 bits` steps by 1.5 % instead of 0.3.
  static constexpr double kEased = 0.5;
  static constexpr double kShrink = 0.4;  ///< of a failed step, for the next try
  /// Fraction of a step below which the proxy stops and lags. In a groove that the tool itself has
  /// cut, its play is hundredths of a unit, and longer steps only meet the other wall.
  static constexpr double kShortest = 0.02;
  static constexpr double kPush = 0.5;  ///< longest correction of one push
  /// The tool may be this deep in one wall if a push out of it leads into another. The depths of
  /// two opposite faces differ by some hundredths between positions. Without this rule, a tool that
  /// is rotated until both faces hold it is stuck whatever the hand does: that happened to 4 % of
  /// the tools that spin askew in slots, and with 0.03 to one in a thousand. The tool may also be
  /// this deep if a tick has no query left for a push before it kept any step; otherwise it would
  /// be stuck, too. It is the depth of the tool's surface; its samples may be less deep
  /// (wedged_depth).
  static constexpr double kWedged = 0.05;
  /// No step ends farther from the goal than the nearest position of the tick by more than this. If
  /// it is larger, a tool at rest wanders on noise. If it is below two kTolerance, by which allowed
  /// positions differ in depth, a tool cannot leave a slot without play.
  static constexpr double kAstray = 0.03;
};

/// How deep a wedged tool may be by its samples, so that no point of its surface is deeper than
/// kWedged: less by what the surface reaches beyond them (docs/theory.md 4.2).
template <class N>
[[nodiscard]] constexpr typename N::Real wedged_depth(typename N::Real deficit) noexcept {
  using Real = typename N::Real;
  return std::max(Real(SweepRules::kTolerance), Real(SweepRules::kWedged) - deficit);
}

/// Sine of half the largest rotation theta of one step (docs/theory.md 4.6): a sample `reach` units
/// from the centre, reach >= 1, moves by kStep at most, as theta / 2 <= 1.0472 sin(theta / 2).
[[nodiscard]] constexpr double rotation_step_of(double reach) noexcept {
  return SweepRules::kStep / (2 * 1.0472 * reach);
}

/// Position and orientation of the proxy.
template <class N>
struct ProxyPose {
  ContactVec<typename N::Real> centre{};
  Orientation<N> orientation{};

  friend constexpr bool operator==(const ProxyPose&, const ProxyPose&) noexcept = default;
};

/// Result of one tick of the sweep.
template <class N>
struct SweepResult {
  ConstraintSet<N> planes;   ///< that hold the proxy; depths from its centre
  ConstrainedMove<N> slide;  ///< of the displacement to the goal; loads in units
  std::int32_t queries = 0;
  bool turned = true;  ///< the tool has the orientation of the goal
  typename N::Real depth{-1};
  bool no_normal = false;  ///< nothing to push against: the start rule is needed
};

/// Memory of the sweep from tick to tick, as long as tool and solid are the same.
template <class N>
struct SweepMemory {
  /// Of the solid around the tool in its orientation. If it were estimated anew in each tick, the
  /// error of a tick's first step would be the noise of a normal times the spring: deep in a bore
  /// of its own size, a tool would jump by a unit in a tick.
  CurvatureEstimate<N> curvature;
  std::int32_t stuck_ticks = 0;  ///< ticks in a row that found no step
};

/// One tick of the proxy (docs/theory.md 4.2, 4.6): it moves from a pose that the solid allows
/// towards a goal, first in orientation, then in position. When its queries or its attempts are
/// spent, it lags. It never jumps, so a wall of 2 units holds it at any speed.
///
/// If the work of a tick is spent before any step was kept, the next tick would fail in the same
/// way. So it does not rotate, and its first step is kShrink times that of the last tick, down to
/// kShortest: each length is the first try of one tick. Then it starts again with whole steps.
///
/// From an allowed position the tool goes at most kAstray farther from its goal. In a groove of its
/// own shape, planes that change from query to query would otherwise lead it farther and farther.
///
/// At most kMaxQueries calls of `query`. Coordinates within +-kContactLimit.
///
/// Limits: a loose fragment less than 1.5 units across may pass between the samples. A fragment
/// that is wholly inside the tool has no contact until the tool leaves it; if it is at least 2
/// units across it may then hold the tool. The tool may fail to enter a slot without any play.
template <class N, ContactField<N> Field>
class ProxySweep {
  using Real = typename N::Real;
  using Unit = typename N::Unit;
  using Position = ContactVec<Real>;

 public:
  /// `friction`: Coulomb's coefficient, 0 to 1. `rotation_step`: rotation_step_of(reach), or 0 for
  /// a tool that does not rotate or is round. `memory`: of the last tick, or new.
  constexpr ProxySweep(Field& field, ProxyPose<N>& pose, SweepMemory<N>& memory, Unit friction,
                       Unit rotation_step) noexcept
      : field_(field),
        pose_(pose),
        memory_(memory),
        friction_(friction),
        rotation_step_(rotation_step),
        wedged_(wedged_depth<N>(field.deficit())) {}

  constexpr SweepResult<N> tick(const ProxyPose<N>& goal) noexcept {
    here_ = turn_to(goal.orientation);
    held_by_ = constraints_of(here_);
    const ConstrainedMove<N> slide = move_to(goal.centre);
    return {held_by_,    slide,          queries_, pose_.orientation == goal.orientation,
            here_.depth, here_.no_normal};
  }

 private:
  /// A position that was tried: where the tool ended after the pushes, its contacts there and the
  /// planes that it met; `first` are the contacts before the pushes.
  struct Trial {
    Position centre;
    Contacts<N> contacts;
    ConstraintSet<N> planes;
    Contacts<N> first;
    bool allowed = false;  ///< the solid allows the tool at `centre`
  };
  enum class Trying { orient, move };

  constexpr Contacts<N> query(Position centre) noexcept {
    ++queries_;
    return field_.query(centre);
  }
  [[nodiscard]] constexpr bool queries_left() const noexcept {
    return queries_ < SweepRules::kMaxQueries;
  }
  /// Whether the tool is not deeper than a wedged tool may be, so that it need not get out.
  [[nodiscard]] constexpr bool allows_rest(const Contacts<N>& contacts) const noexcept {
    return !contacts.no_normal && contacts.depth <= wedged_;
  }
  /// Whether the depth is within the tolerance or, if the tool is too deep already, not above its
  /// present depth.
  [[nodiscard]] constexpr bool allows(const Contacts<N>& contacts, Real tolerance) const noexcept {
    return !contacts.no_normal && contacts.depth <= std::max(tolerance, here_.depth);
  }

  /// Whether planes hold the tool back: their loads together reach kLeastLoad.
  [[nodiscard]] static constexpr bool bears(const ConstrainedMove<N>& slide) noexcept {
    Real whole(0);
    for (const Real load : slide.load) whole = whole + load;
    return whole >= Real(SweepRules::kLeastLoad);
  }

  /// The next displacement from a position.
  struct Route {
    ConstrainedMove<N> slide;  ///< under the planes alone
    Position displacement;     ///< that friction leaves of it
    Real length;
  };

  /// Coulomb's friction (docs/theory.md 4.5): across the pressing direction the tool sticks if its
  /// displacement is at most friction times the load; otherwise it slides less by that amount.
  /// There is no friction towards the planes.
  [[nodiscard]] constexpr Route route(const ConstraintSet<N>& planes,
                                      Position displacement) const noexcept {
    const ConstrainedMove<N> slide = constrained_move(planes, displacement);
    const Position& move = slide.move;
    if (friction_ <= Unit(0) || planes.count == 0) return {slide, move, norm(move)};
    const Position pressed = move - displacement;
    const auto normal = direction_of<N>(pressed);
    const Position closing = times<N>(normal, along<N>(normal, move));
    const Position rubbing = move - closing;
    const Real held = multiply<Real>(friction_, norm(pressed));
    const Real length = norm(rubbing);
    if (length <= held) return {slide, closing, norm(closing)};
    const Position left = closing + part_of<N>(rubbing, fraction<N>(length - held, length));
    return {slide, left, norm(left)};
  }

  /// Queries `centre`, which is `moved` from the position of the depths of `known`. A tool that is
  /// too deep there is pushed out, twice at most. A rotation begins no push in the second half of
  /// the tick's work.
  constexpr Trial attempt(Trying what, Position centre, const ConstraintSet<N>& known,
                          Position moved) noexcept {
    const bool turns = what == Trying::orient;
    const auto tolerance =
        static_cast<Real>(turns ? SweepRules::kTurnTolerance : SweepRules::kTolerance);
    const Contacts<N> first = query(centre);
    Trial trial{centre, first, constraints_of(first), first};
    keep(trial.planes, known, moved);
    const ConstraintSet<N> unpushed = trial.planes;
    Position pushed{};
    int pushes = 0;
    for (; pushes < 2; ++pushes) {
      if (allows(trial.contacts, tolerance) || trial.contacts.count == 0) break;
      if (!queries_left() || !field_.may_query()) break;
      if (turns && field_.half_spent()) break;
      for (auto& plane : trial.planes.plane) {
        plane.depth = std::min(plane.depth, Real(SweepRules::kPush));
      }
      pushed = pushed + constrained_move(trial.planes, {}).move;
      trial.centre = centre + pushed;
      trial.contacts = query(trial.centre);
      trial.planes = constraints_of(trial.contacts);
      keep(trial.planes, known, moved + pushed);
    }
    trial.allowed = allows(trial.contacts, tolerance);
    if (!turns && !trial.allowed && (pushes > 0 || !kept_) && allows_rest(first)) {
      return {centre, first, unpushed, first, true};
    }
    keep(trial.planes, constraints_of(first), pushed);
    return trial;
  }

  /// Longest push of the tool by a rotation to `next`: as far as it moves the tool's own samples,
  /// which is enough for one wall. A wedge of two walls would need more: it would lift the tool
  /// out.
  [[nodiscard]] constexpr Real longest_push(const Orientation<N>& next) const noexcept {
    const Unit of_step =
        std::min(half_sine_between(next, pose_.orientation) / rotation_step_, Unit(1));
    return multiply<Real>(Real(SweepRules::kStep), of_step) + Real(SweepRules::kTolerance);
  }

  /// Rotates towards `goal` while allowed positions are found. Returns the contacts then.
  constexpr Contacts<N> turn_to(const Orientation<N>& goal) noexcept {
    if (rotation_step_ <= Unit(0)) {
      pose_.orientation = goal;
      field_.orient(goal);
      return query(pose_.centre);
    }
    Unit step = rotation_step_;
    bool known = false;
    const bool goes_on = first_step() < Unit(1);  // with the last tick's move
    while (!goes_on && !(pose_.orientation == goal) && queries_ < SweepRules::kMaxRotationQueries &&
           !field_.half_spent()) {
      const Orientation<N> next = rotate_towards(pose_.orientation, goal, step);
      field_.orient(next);
      const Trial trial = attempt(Trying::orient, pose_.centre, {}, {});
      if (trial.allowed && norm(trial.centre - pose_.centre) <= longest_push(next)) {
        pose_ = {trial.centre, next};
        memory_.curvature = {};
        here_ = trial.contacts;
        known = true;
        step = rotation_step_;
      } else {
        step = step * Unit(SweepRules::kShrink);
        if (step < rotation_step_ * Unit(SweepRules::kShortest)) break;
      }
    }
    field_.orient(pose_.orientation);
    return known ? here_ : query(pose_.centre);
  }

  /// The route in a bowl, from a position whose deepest plane is the first.
  [[nodiscard]] constexpr Route eased_route(const ConstraintSet<N>& planes,
                                            Position displacement) const noexcept {
    Route onward = route(planes, displacement);
    onward.displacement = memory_.curvature.eased(onward.displacement, onward.slide.load[0]);
    onward.length = norm(onward.displacement);
    return onward;
  }

  /// Moves towards `goal` as long as steps are found that the solid allows and that are progress:
  /// the displacement that is left under all known planes shrinks to kResidual of it, or the goal
  /// comes nearer. With the distance to the goal alone, the proxy would stick in creases and cycle
  /// in grooves. Returns the constrained move of the last position.
  ///
  /// A displacement below kArrived that no plane opposes ends on the goal, without a query: it is
  /// at most kLeastLoad deep in the known planes, and less than kTolerance in any other. What were
  /// left of it would be a spring in air, which the coupling's damper multiplies by the hand's
  /// speed.
  constexpr ConstrainedMove<N> move_to(Position goal) noexcept {
    Unit shrink = first_step();
    Route onward = eased_route(held_by_, goal - pose_.centre);
    // Farther than any position, while the tool has to get out of the solid.
    Real nearest_yet = allows_rest(here_) ? norm(goal - pose_.centre) : Real(4 * kContactLimit);
    const auto enough = static_cast<Real>(SweepRules::kArrived);
    while (queries_left() && field_.may_query() && !here_.no_normal && onward.length >= enough) {
      const Position from = pose_.centre;
      auto step = static_cast<Real>(SweepRules::kStep);
      // A whole step that failed found no free path, so a shorter one does not search again.
      if (here_.count == 0 && shrink == Unit(1)) {
        step = std::max(step, field_.free_distance(from, onward.displacement));
      }
      const Unit capped = step < onward.length ? fraction<N>(step, onward.length) : Unit(1);
      const Position moved = part_of<N>(onward.displacement, shrink * capped);
      const Trial trial = attempt(Trying::move, from + moved, held_by_, moved);
      memory_.curvature.learn(here_, trial.contacts, trial.centre - from);
      if (trial.allowed) {
        const Route next = eased_route(trial.planes, goal - trial.centre);
        const Real distance = norm(goal - trial.centre);
        const bool strays = distance > nearest_yet + Real(SweepRules::kAstray);
        const bool leads = next.length < multiply<Real>(Unit(SweepRules::kResidual), onward.length);
        if ((leads && !strays) || distance < norm(goal - from) - Real(SweepRules::kGain)) {
          pose_.centre = trial.centre;
          here_ = trial.contacts;
          if (allows_rest(here_)) nearest_yet = std::min(nearest_yet, distance);
          held_by_ = trial.planes;
          onward = next;
          shrink = Unit(1);
          kept_ = true;
          continue;
        }
      }
      const bool learned = add_blocking_planes(held_by_, trial.first, moved);
      const Route again = eased_route(held_by_, goal - from);
      if (learned || again.length < multiply<Real>(Unit(SweepRules::kEased), norm(moved))) {
        onward = again;
      } else {
        shrink = shrink * Unit(SweepRules::kShrink);
        if (shrink < Unit(SweepRules::kShortest)) break;
      }
    }
    if (!here_.no_normal && onward.length < enough && !bears(onward.slide)) pose_.centre = goal;
    memory_.curvature.forget_noise();
    const bool vain = !kept_ && onward.length >= enough && !field_.may_query();
    memory_.stuck_ticks = vain ? memory_.stuck_ticks + 1 : 0;
    if (first_step() < Unit(SweepRules::kShortest)) memory_.stuck_ticks = 0;
    return onward.slide;
  }

  /// Fraction of a step that a tick tries first.
  [[nodiscard]] constexpr Unit first_step() const noexcept {
    Unit step(1);
    for (std::int32_t tick = 0; tick < memory_.stuck_ticks; ++tick) {
      step = step * Unit(SweepRules::kShrink);
    }
    return step;
  }

  Field& field_;
  ProxyPose<N>& pose_;
  SweepMemory<N>& memory_;
  Unit friction_;
  Unit rotation_step_;
  Real wedged_;  ///< depth that a wedged tool may have
  Contacts<N> here_{};
  ConstraintSet<N> held_by_{};
  std::int32_t queries_ = 0;
  bool kept_ = false;  ///< the move has kept a step
};

}  // namespace kerf
