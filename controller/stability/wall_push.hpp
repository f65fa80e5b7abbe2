// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "controller/stability/one_axis.hpp"
#include "controller/stability/sampled_loop.hpp"

namespace kerf {

/// A hand that comes to a wall and pushes on: from rest outside, with a constant force.
struct WallPush {
  double from_mm = -0.1;
  double push_n = 0.5;  ///< on top of the device's Coulomb friction
  double seconds = 3;
};

/// What such a push showed, thirds of its time apart.
struct WallSwing {
  std::array<double, 3> span_mm{};   ///< peak to peak
  std::array<double, 3> motor_mj{};  ///< work of the motors at the end of each third
  double quantum_mm = 0;

  /// By the motion: the last third swings by more than three quanta and has not died down.
  [[nodiscard]] bool swings_on() const noexcept {
    constexpr double kNothingMm = 1e-6;  // of an encoder without a quantum
    constexpr double kDiedDown = 0.97;
    return span_mm[2] > std::max(3 * quantum_mm, kNothingMm) &&
           span_mm[2] >= kDiedDown * span_mm[1];
  }
  /// By the energy: in the last third the motors gave more than they took.
  [[nodiscard]] bool gives_energy() const noexcept {
    constexpr double kNothingMj = 1e-9;
    return motor_mj[2] - motor_mj[1] > kNothingMj;
  }
};

/// Plays the push against any law: `force_n(encoder_mm)` once per period, towards negative places
/// out of the wall. The loop's motion stops where it is far beyond any device (1 m).
template <class Law>
[[nodiscard]] WallSwing push_on_wall(const SampledLoop& loop, Law&& force_n,
                                     const WallPush& push = {}) {
  constexpr double kLostMm = 1000;
  OneAxis axis(loop);
  axis.start(push.from_mm);
  WallSwing swing;
  swing.quantum_mm = loop.quantum_mm;
  const auto ticks = static_cast<long>(push.seconds / loop.period_s);
  for (std::size_t third = 0; third < 3; ++third) {
    double low = axis.place_mm(), high = low;
    const long end = ticks * static_cast<long>(third + 1) / 3;
    for (long i = ticks * static_cast<long>(third) / 3; i < end; ++i) {
      axis.tick(force_n(axis.encoder_mm()), loop.coulomb_n + push.push_n);
      low = std::min(low, axis.place_mm());
      high = std::max(high, axis.place_mm());
      if (high - low > kLostMm) break;
    }
    swing.span_mm[third] = high - low;
    swing.motor_mj[third] = axis.motor_work_mj();
  }
  return swing;
}

/// The same against the sampled wall.
[[nodiscard]] inline WallSwing push_on_wall(const SampledLoop& loop, double stiffness_n_per_mm,
                                            double damping_ns_per_mm, const WallPush& push = {}) {
  SampledWall wall(loop, stiffness_n_per_mm, damping_ns_per_mm);
  wall.start(push.from_mm);
  return push_on_wall(
      loop, [&](double encoder_mm) { return wall.force_n(encoder_mm); }, push);
}

}  // namespace kerf
