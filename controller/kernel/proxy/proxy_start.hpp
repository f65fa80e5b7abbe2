// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/proxy/proxy_sweep.hpp"

namespace kerf {

/// Whether the proxy has a place, and if not whether one is still looked for.
enum class Placing : std::uint8_t { searching, placed, refused };

/// Finds the first place of a proxy (docs/theory.md 4.7). Each tick tries half of the 26
/// directions. With nothing free within kReach the tool is refused until its own goal is free.
///
/// At most 14 queries a tick. Only the tool's surface is felt: what lies wholly inside of the tool
/// does not count as solid here.
template <class N>
class StartSearch {
  using Real = typename N::Real;
  using Place = ContactVec<Real>;

 public:
  static constexpr std::int32_t kReach = 64;  ///< units

  template <ContactField<N> Field>
  constexpr Placing tick(Field& field, const ProxyPose<N>& goal, ProxyPose<N>& pose) noexcept {
    field.turn(goal.turn);
    if (is_free(field, goal.centre)) {
      pose = goal;
      return Placing::placed;
    }
    if (distance_ == kReach && !halfway_) return Placing::refused;
    if (!halfway_) ++distance_;
    halfway_ = !halfway_;
    // Direction 13 is (0, 0, 0): none.
    for (int direction = halfway_ ? 0 : 14, end = direction + 13; direction < end; ++direction) {
      const Place centre = goal.centre + step(direction);
      if (is_free(field, centre)) {
        pose = {centre, goal.turn};
        return Placing::placed;
      }
    }
    return Placing::searching;
  }

 private:
  template <ContactField<N> Field>
  [[nodiscard]] static constexpr bool is_free(Field& field, Place centre) noexcept {
    const Contacts<N> felt = field.query(centre);
    return !felt.buried && felt.depth <= Real(SweepRules::kTolerance);
  }
  /// `distance_` along one of the 27 directions of a 3x3x3 cube, by number.
  [[nodiscard]] constexpr Place step(int direction) const noexcept {
    constexpr double kPerAxis[4] = {0, 1, 0.7071067811865476, 0.5773502691896258};
    const int x = direction % 3 - 1, y = direction / 3 % 3 - 1, z = direction / 9 - 1;
    const Real part = Real(distance_) * static_cast<Real>(kPerAxis[x * x + y * y + z * z]);
    return {Real(x) * part, Real(y) * part, Real(z) * part};
  }

  std::int32_t distance_ = 0;
  bool halfway_ = false;  ///< the first half of the directions was tried at this distance
};

}  // namespace kerf
