// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "controller/kernel/proxy/proxy_sweep.hpp"

// The proxy: search for a free start, its state from tick to tick, and the contact of one tick.

namespace kerf {

/// Whether the proxy has a position; if not, whether the search for one continues.
enum class ProxyStatus : std::uint8_t { searching, placed, refused };

/// Searches a free position for the proxy (docs/theory.md 4.7): in 26 directions at one distance,
/// then one unit farther out. If no position within kReach is free, the tool is refused until its
/// own goal is free.
///
/// For a tool that replaces another, the search is around the old position, not around the goal,
/// and stays on the same side of every wall: a direction in which the tool's centre has left the
/// solid, or began outside it, ends before the centre would enter the solid again.
///
/// At most 14 queries a tick, and no more than the budget of the tick allows: the next tick
/// continues. Only the surface of the tool is tested: solid wholly inside of the tool does not
/// count.
template <class N>
class StartSearch {
  using Real = typename N::Real;
  using Position = ContactVec<Real>;

 public:
  static constexpr std::int32_t kReach = 64;  ///< units

  StartSearch() = default;
  /// Searches around the position of a former tool.
  explicit constexpr StartSearch(Position around) noexcept : around_(around), replaces_(true) {}
  /// A new search from the same start, for another tool.
  [[nodiscard]] constexpr StartSearch again() const noexcept {
    return replaces_ ? StartSearch(around_) : StartSearch();
  }
  [[nodiscard]] constexpr bool refused() const noexcept { return distance_ > kReach; }

  template <ContactField<N> Field>
  constexpr ProxyStatus tick(Field& field, const ProxyPose<N>& goal, ProxyPose<N>& pose) noexcept {
    field.orient(goal.orientation);
    const Position middle = replaces_ && !refused() ? around_ : goal.centre;
    const auto tolerance = Real(SweepRules::kTolerance);
    if (is_free(field, middle, replaces_ ? wedged_depth<N>(field.deficit()) : tolerance)) {
      pose = {middle, goal.orientation};
      return ProxyStatus::placed;
    }
    if (refused()) return ProxyStatus::refused;
    for (int queries = 0; queries < kQueries && field.may_query();) {
      if (direction_ == kDirections) {
        direction_ = 0;
        ++distance_;
        if (refused()) return ProxyStatus::refused;
      }
      const int direction = direction_++;
      const Position centre = middle + step(direction);
      if (!leads_on(field, direction, middle, centre)) continue;
      ++queries;
      if (is_free(field, centre, tolerance)) {
        pose = {centre, goal.orientation};
        return ProxyStatus::placed;
      }
    }
    return ProxyStatus::searching;
  }

 private:
  static constexpr int kDirections = 27, kQueries = 13;

  template <ContactField<N> Field>
  [[nodiscard]] static constexpr bool is_free(Field& field, Position centre, Real depth) noexcept {
    const Contacts<N> contacts = field.query(centre);
    return !contacts.no_normal && contacts.depth <= depth;
  }
  /// Whether this direction still leads out of the solid at `centre`, one unit after the last.
  template <ContactField<N> Field>
  [[nodiscard]] constexpr bool leads_on(const Field& field, int direction, Position middle,
                                        Position centre) noexcept {
    const std::uint32_t bit = 1U << direction;
    if (direction == kDirections / 2 || (ended_ & bit) != 0)
      return false;  // the middle is no direction
    if (distance_ == 1 && !field.is_solid(middle)) outside_ |= bit;
    const bool solid = field.is_solid(centre);
    if (solid && (outside_ & bit) != 0) ended_ |= bit;
    if (!solid) outside_ |= bit;
    return (ended_ & bit) == 0;
  }
  /// `distance_` along one of the 27 directions of a 3x3x3 cube, by number.
  [[nodiscard]] constexpr Position step(int direction) const noexcept {
    constexpr double kPerAxis[4] = {0, 1, 0.7071067811865476, 0.5773502691896258};
    const int x = direction % 3 - 1, y = direction / 3 % 3 - 1, z = direction / 9 - 1;
    const Real part = Real(distance_) * static_cast<Real>(kPerAxis[x * x + y * y + z * z]);
    return {Real(x) * part, Real(y) * part, Real(z) * part};
  }

  Position around_{};
  bool replaces_ = false;
  std::int32_t distance_ = 1;
  int direction_ = 0;  ///< to be tried next at this distance
  std::uint32_t outside_ = 0,
                ended_ = 0;  ///< by direction: the centre left the solid, or met it again
};

/// Constants of the swept contact of one tool; constant during a run.
template <class N>
struct ProxyPlan {
  typename N::Unit friction{};  ///< Coulomb's coefficient, 0 to 1
  typename N::Unit
      rotation_step{};  ///< rotation_step_of(reach); 0: round, or keeps the world's axes
  /// Growth of the spring per tick after a start inside of the solid: 0.1 N/ms over its stiffness.
  typename N::Real ramp_per_tick{};
};

/// The state from tick to tick. A new state searches a position at the goal. It is made when the
/// device is parked at rest, or is no longer homed.
template <class N>
struct ProxyState {
  ProxyPose<N> pose;
  bool valid = false;
  StartSearch<N> search;
  bool ramping = false;
  typename N::Real longest{};  ///< limit of the spring while it ramps, units
  SweepMemory<N> memory;

  /// Searches a position around the current one: another tool took over, or the solid changed.
  constexpr void search_again() noexcept {
    search = valid ? StartSearch<N>(pose.centre) : search.again();
    valid = false;
    memory = {};
  }
  /// The spring grows from 0 again, after ticks without force.
  constexpr void ramp() noexcept {
    ramping = true;
    longest = {};
  }
};

/// The contact of one tick.
template <class N>
struct ProxyContact {
  ProxyStatus status = ProxyStatus::searching;
  ProxyPose<N> pose;
  ContactVec<typename N::Real> spring{};  ///< from goal to proxy, units: force over stiffness
  /// Direction of the press of the head, out of the solid; 0 in air.
  ContactVec<typename N::Unit> normal{};
  /// Direction of the press of the whole tool, and the head's load relative to that press, at most
  /// 1. Without a press of the shaft, they are `normal` and 1.
  ContactVec<typename N::Unit> press{};
  typename N::Unit head_fraction{1};
  /// Load of shaft and handpiece over the length of the spring, at most 1.
  typename N::Unit shaft_fraction{};
  /// Torque about the tool's centre over the force's length, units.
  ContactVec<typename N::Real> moment_arm{};
  /// From the tool's centre to the middle of the head's loads, units.
  ContactVec<typename N::Real> head_lever{};
  /// The planes that hold the tool, and the load of each over the length of the spring.
  ConstraintSet<N> planes{};
  std::array<typename N::Real, kMaxPlanes> part{};
  std::int32_t queries = 0;
  bool turned = true;  ///< the tool has the orientation of the goal
};

/// No tool gets deeper than this by moving. If it is deeper, the solid has changed, and the search
/// starts again.
inline constexpr double kLostDepth = 1;  // units

/// Sets normal and moment arm of the contact: the sum of the loads, and its moment over the length
/// of the spring (docs/forces.md 5.3). Friction acts at the points of the loads.
///
/// The part of the spring beyond the loads and the friction cone is carried by planes that this
/// tick did not meet (docs/theory.md 4.5). So a tool at rest, where forces balance, always has a
/// normal. A tool that is still `moving` is not held by such planes. They count as planes of the
/// head, which is safe because it cuts only the voxels that it covers.
template <class N>
constexpr void add_loads(const SweepResult<N>& swept, typename N::Unit friction, bool moving,
                         ProxyContact<N>& contact) noexcept {
  using Real = typename N::Real;
  const Real length = norm(contact.spring);
  if (length < Real(1e-3)) return;
  ContactVec<Real> pressed{}, on_shaft{}, lever{}, head_lever{};
  Real whole(0), shaft_load(0);
  for (std::size_t i = 0; i < swept.planes.count; ++i) whole = whole + swept.slide.load[i];
  const bool loaded = whole >= Real(SweepRules::kLeastLoad);
  if (!loaded && moving) return;
  if (!loaded && swept.planes.count > 0) lever = head_lever = swept.planes.plane[0].lever;
  if (loaded) contact.planes = swept.planes;
  for (std::size_t i = 0; loaded && i < swept.planes.count; ++i) {
    const ConstraintPlane<N>& plane = swept.planes.plane[i];
    const Real load = swept.slide.load[i];
    pressed = pressed + times<N>(plane.normal, load);
    if (plane.on_shaft) {
      on_shaft = on_shaft + times<N>(plane.normal, load);
      shaft_load = shaft_load + load;
    } else {
      head_lever = head_lever + part_of<N>(plane.lever, fraction<N>(load, whole));
    }
    lever = lever + part_of<N>(plane.lever, fraction<N>(load, whole));
    contact.part[i] = load / length;
    contact.moment_arm =
        contact.moment_arm + moment<N>(plane.lever, plane.normal) * contact.part[i];
  }
  const ContactVec<Real> along_faces = contact.spring - pressed;
  const Real rubbed = norm(along_faces);
  const Real held = multiply<Real>(friction, norm(pressed));
  if (rubbed > held && !moving)
    pressed = pressed + part_of<N>(along_faces, fraction<N>(rubbed - held, rubbed));
  // If the shaft presses, a press of the head below the tolerance of a position is ignored.
  const ContactVec<Real> head = pressed - on_shaft;
  const Real by_head = norm(head);
  if (shaft_load <= Real(0) || by_head >= Real(SweepRules::kTolerance)) {
    contact.normal = direction_of<N>(head);
  }
  contact.moment_arm = contact.moment_arm + moment<N>(lever, direction_of<N>(along_faces)) *
                                                (std::min(rubbed, length) / length);
  contact.head_lever = head_lever;
  contact.press = direction_of<N>(pressed);
  if (shaft_load <= Real(0)) return;
  const Real on_head = whole - shaft_load;
  if (on_head > Real(1e-3)) contact.head_lever = head_lever * (whole / on_head);
  contact.shaft_fraction = fraction<N>(std::min(shaft_load, length), length);
  // If the loads of shaft and head oppose each other, each may exceed the press of the hand.
  const Real together = norm(pressed);
  const bool presses = by_head >= Real(SweepRules::kTolerance);
  if (!presses || by_head < together) {
    contact.head_fraction = presses ? fraction<N>(by_head, together) : typename N::Unit(0);
  }
}

/// One tick of the swept contact (docs/theory.md 4): the proxy follows `goal`, and the spring
/// between them gives the force.
///
/// Servo thread; pure except for `state`. At most 32 queries, or 14 during the search. Before the
/// proxy has a position there is no force. A goal that is not finite changes nothing and gives no
/// force; a far goal is clamped to kContactLimit.
template <class N, ContactField<N> Field>
constexpr ProxyContact<N> follow(const ProxyPlan<N>& plan, ProxyState<N>& state, Field& field,
                                 ProxyPose<N> goal) noexcept {
  using Real = typename N::Real;
  ProxyContact<N> contact;
  contact.pose = state.pose;
  contact.status = state.valid ? ProxyStatus::placed : ProxyStatus::searching;
  if (!is_finite(goal.centre.x + goal.centre.y + goal.centre.z) ||
      !is_finite(goal.orientation.x + goal.orientation.y + goal.orientation.z +
                 goal.orientation.w)) {
    return contact;
  }
  const auto clamped = [](Real at) {
    return std::clamp(at, Real(-kContactLimit), Real(kContactLimit));
  };
  goal.centre = {clamped(goal.centre.x), clamped(goal.centre.y), clamped(goal.centre.z)};
  if (!state.valid) {
    contact.status = state.search.tick(field, goal, state.pose);
    state.valid = contact.status == ProxyStatus::placed;
    state.ramping = state.valid && !(state.pose == goal);
    state.longest = Real(0);
    contact.pose = state.valid ? state.pose : goal;
    return contact;
  }
  const ProxyPose<N> last = state.pose;
  const SweepResult<N> swept =
      ProxySweep<N, Field>(field, state.pose, state.memory, plan.friction, plan.rotation_step)
          .tick(goal);
  contact.pose = state.pose;
  contact.queries = swept.queries;
  contact.turned = swept.turned;
  if (swept.no_normal || swept.depth > Real(kLostDepth)) {
    state.pose = last;
    state.search_again();
    contact.status = ProxyStatus::searching;
    contact.pose = goal;
    return contact;
  }
  contact.spring = state.pose.centre - goal.centre;
  // After a whole step the proxy may only lag because the tick's work was spent.
  const bool moving = norm(state.pose.centre - last.centre) >= Real(SweepRules::kStep);
  add_loads(swept, plan.friction, moving, contact);
  if (state.ramping) {
    state.longest = state.longest + plan.ramp_per_tick;
    const Real length = norm(contact.spring);
    state.ramping = length > state.longest;
    if (state.ramping)
      contact.spring = part_of<N>(contact.spring, fraction<N>(state.longest, length));
  }
  return contact;
}

}  // namespace kerf
