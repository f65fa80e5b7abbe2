// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hil/devmodel/hand_script.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Position along a rest-to-rest motion of least jerk (Flash and Hogan 1985); t and result 0..1.
[[nodiscard]] constexpr double least_jerk(double t) noexcept {
  return t * t * t * (10 + t * (-15 + 6 * t));
}

/// The way of a hand from where it is to the start of its script: one cubic Bezier curve, device
/// mm, gone through with least jerk. Its points are where the hand is, above that, beside the
/// workpiece, and the start; without a detour they lie on a line.
struct ReachCurve {
  /// A quick reach of the arm, at its fastest.
  static constexpr double kMaxMmPerS = 1000;
  static constexpr double kMaxMmPerS2 = 10'000;
  /// A soft or heavy hand is so slow that the tip swings past its start by this at most: half of
  /// the least way that the project's scripts keep from the surface.
  static constexpr double kSwingMm = 2;

  std::array<DeviceVec<double>, 4> points_mm;

  [[nodiscard]] DeviceVec<double> at(double progress) const noexcept;
  /// The least duration within the three bounds above, s. A mass on a spring of natural frequency w
  /// swings about its lag, and a jerk j adds j / w^3 to the swing. The limits of a motion of
  /// duration T are those of T = 1 s over T, T^2 and T^3, so 1 s is sampled.
  [[nodiscard]] double least_seconds(double hand_rad_per_s) const noexcept;
};

[[nodiscard]] ReachCurve reach_curve(const HandRoute& route, DeviceVec<double> from_mm,
                                     DeviceVec<double> start_mm) noexcept;

}  // namespace kerf
