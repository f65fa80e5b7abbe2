// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/stability/limit_cycle.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/press.hpp"
#include "lab/stability/tick_watch.hpp"

namespace kerf::zwidth {

/// The slowest motion of a press, s: the period of the spring and the mass, with the longest of
/// three flights. Let go with the most force for all of the delay, or thrown back as fast as it
/// came, at 200 mm/s at least, the tip flies until the push has taken the same impulse back (a
/// hand's spring would turn it back sooner). Or it comes in so fast that the wall's force is at its
/// peak, and what the peak is above the push turns it back. Never below 0.25 s.
[[nodiscard]] double slowest_swing_s(const LoopCase& subject, double stiffness_n_per_mm,
                                     const Press& press);

/// Ticks of a run that watches for such a swing. `remembered_s` is how long an earlier motion of a
/// tip that is held has an effect, beyond the delay and the velocity window.
[[nodiscard]] LimitCycleDetector::Ticks hit_ticks(const LoopCase& subject,
                                                  double stiffness_n_per_mm, const Press& press,
                                                  double limit_s, double remembered_s);

/// One axis against a wall at 0, the solid below: exact mechanics and the servo's own coupling,
/// velocity window and force limits, in the subject's numbers.
///
/// `seed` shifts the encoder's steps against the wall by a part of one; 0: an edge lies on it.
/// `limit_s` is that of the verdict. The same arguments give the same bits. Throws Interrupted.
[[nodiscard]] LimitCycle hit_one_axis(const LoopCase& subject, double stiffness_n_per_mm,
                                      const Press& press, double limit_s, std::uint64_t seed,
                                      StepCounter& ticks, const SwingWatch& watch = {});

}  // namespace kerf::zwidth
