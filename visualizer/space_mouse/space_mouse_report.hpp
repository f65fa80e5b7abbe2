// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace kerf {

/// What a SpaceMouse of 3Dconnexion holds: six axes and the first button.
///
/// x points right, y to the user, z down; the rotations are right-handed about them. An axis says
/// how far the cap is pushed, -1 to 1; the cap springs back, and then says 0.
struct SpaceMouseState {
  std::array<double, 3> push{}, turn{};
  bool button = false;
};

/// Takes an input report as it comes from hidraw, its identity first; false, and `state` as it was,
/// where it is none. There are two layouts, of numbers of 16 bits, the lower byte first:
///
///     1 x y z, 2 rx ry rz      7 bytes each
///     1 x y z rx ry rz         13 bytes
///     3 buttons                2 to 8 bytes, a bit for each
///
/// A number beyond +-350, which is where the cap ends, counts as that.
bool take_report(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept;

}  // namespace kerf
