// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/proxy/proxy_sweep.hpp"

namespace kerf {

/// Whether the proxy has a place, and if not whether one is still looked for.
enum class Placing : std::uint8_t { searching, placed, refused };

/// Finds a place of the proxy (docs/theory.md 4.7). Of 26 directions each is tried one unit farther
/// out once all were tried. With nothing free within kReach the tool is refused until its own goal
/// is free.
///
/// A tool that takes another's place is sought around that place, not around the goal, and stays on
/// its side of every wall: a direction in which the tool's centre came out of the solid, or began
/// outside of it, ends where the centre would go into it again.
///
/// At most 14 queries a tick, and no more than the tick's work allows: the next tick goes on. Only
/// the tool's surface is felt: what lies wholly inside of the tool does not count as solid here.
template <class N>
class StartSearch {
  using Real = typename N::Real;
  using Place = ContactVec<Real>;

 public:
  static constexpr std::int32_t kReach = 64;  ///< units

  StartSearch() = default;
  /// Around a place that a tool had.
  explicit constexpr StartSearch(Place around) noexcept : around_(around), replaces_(true) {}
  /// The same anew, for another tool.
  [[nodiscard]] constexpr StartSearch again() const noexcept {
    return replaces_ ? StartSearch(around_) : StartSearch();
  }
  [[nodiscard]] constexpr bool refused() const noexcept { return distance_ > kReach; }

  template <ContactField<N> Field>
  constexpr Placing tick(Field& field, const ProxyPose<N>& goal, ProxyPose<N>& pose) noexcept {
    field.turn(goal.turn);
    const Place middle = replaces_ && !refused() ? around_ : goal.centre;
    if (is_free(field, middle, replaces_ ? SweepRules::kWedged : SweepRules::kTolerance)) {
      pose = {middle, goal.turn};
      return Placing::placed;
    }
    if (refused()) return Placing::refused;
    for (int queries = 0; queries < kQueries && field.may_query();) {
      if (direction_ == kDirections) {
        direction_ = 0;
        ++distance_;
        if (refused()) return Placing::refused;
      }
      const int direction = direction_++;
      const Place centre = middle + step(direction);
      if (!leads_on(field, direction, middle, centre)) continue;
      ++queries;
      if (is_free(field, centre, SweepRules::kTolerance)) {
        pose = {centre, goal.turn};
        return Placing::placed;
      }
    }
    return Placing::searching;
  }

 private:
  static constexpr int kDirections = 27, kQueries = 13;

  template <ContactField<N> Field>
  [[nodiscard]] static constexpr bool is_free(Field& field, Place centre, double depth) noexcept {
    const Contacts<N> felt = field.query(centre);
    return !felt.buried && felt.depth <= static_cast<Real>(depth);
  }
  /// Whether this direction still leads out of the solid at `centre`, one unit after the last.
  template <ContactField<N> Field>
  [[nodiscard]] constexpr bool leads_on(const Field& field, int direction, Place middle,
                                        Place centre) noexcept {
    const std::uint32_t bit = 1U << direction;
    if (direction == kDirections / 2 || (ended_ & bit) != 0) return false;  // the middle is none
    if (distance_ == 1 && !field.is_solid(middle)) outside_ |= bit;
    const bool solid = field.is_solid(centre);
    if (solid && (outside_ & bit) != 0) ended_ |= bit;
    if (!solid) outside_ |= bit;
    return (ended_ & bit) == 0;
  }
  /// `distance_` along one of the 27 directions of a 3x3x3 cube, by number.
  [[nodiscard]] constexpr Place step(int direction) const noexcept {
    constexpr double kPerAxis[4] = {0, 1, 0.7071067811865476, 0.5773502691896258};
    const int x = direction % 3 - 1, y = direction / 3 % 3 - 1, z = direction / 9 - 1;
    const Real part = Real(distance_) * static_cast<Real>(kPerAxis[x * x + y * y + z * z]);
    return {Real(x) * part, Real(y) * part, Real(z) * part};
  }

  Place around_{};
  bool replaces_ = false;
  std::int32_t distance_ = 1;
  int direction_ = 0;                      ///< to be tried next at this distance
  std::uint32_t outside_ = 0, ended_ = 0;  ///< by direction: the centre is, or met, as said above
};

}  // namespace kerf
