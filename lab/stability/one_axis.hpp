// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "controller/stability/limit_cycle.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/tick_watch.hpp"

namespace kerf::zwidth {

/// How the hand meets the wall: it starts 0.1 mm before it with this speed and goes on pushing with
/// Coulomb friction and the subject's push.
inline constexpr std::array<double, 3> kHitsMmPerS{0, 50, 200};
inline constexpr double kStartMm = 0.1;

/// The slowest motion of a hit, s: the period of the spring and the mass, with the longer of two
/// flights. Let go with the most force for all of the delay, or thrown back as fast as the fastest
/// hit, the tip flies until the push has taken the same impulse back (a hand's spring would turn it
/// back sooner). Never below 0.25 s.
[[nodiscard]] double slowest_swing_s(const LoopCase& subject, double stiffness_n_per_mm);

/// Ticks of a run that watches for such a swing. `remembered_s` is how long an earlier motion of a
/// tip that is held has an effect, beyond the delay and the velocity window.
[[nodiscard]] LimitCycleDetector::Ticks hit_ticks(const LoopCase& subject,
                                                  double stiffness_n_per_mm, double limit_s,
                                                  double remembered_s);

/// One axis against a wall at 0, the solid below: exact mechanics and the servo's own coupling,
/// velocity window and force limits, in the subject's numbers.
///
/// `seed` shifts the encoder's steps against the wall by a part of one; 0: an edge lies on it.
/// `limit_s` is that of the verdict. The same arguments give the same bits. Throws Interrupted.
[[nodiscard]] LimitCycle hit_one_axis(const LoopCase& subject, double stiffness_n_per_mm,
                                      double hit_mm_per_s, double limit_s, std::uint64_t seed,
                                      StepCounter& ticks, const SwingWatch& watch = {});

}  // namespace kerf::zwidth
