// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "lab/stability/axes.hpp"
#include "lab/stability/limit_cycle.hpp"

namespace kerf::zwidth {

/// How the hand meets the wall: it starts 0.1 mm before it with this speed and goes on pushing with
/// Coulomb friction and the subject's push.
inline constexpr std::array<double, 3> kHitsMmPerS{0, 50, 200};
inline constexpr double kStartMm = 0.1;

/// One axis against a wall at 0, the solid below: exact mechanics and the servo's own coupling,
/// velocity window and force limits, in the subject's numbers.
///
/// `seed` shifts the encoder's steps against the wall by a part of one; 0: an edge lies on it.
/// Returns the verdict of `seconds`. The same arguments give the same bits. Throws Interrupted.
[[nodiscard]] LimitCycle hit_one_axis(const LoopCase& subject, double stiffness_n_per_mm,
                                      double hit_mm_per_s, double seconds, std::uint64_t seed,
                                      StepCounter& ticks, const SwingWatch& watch = {});

}  // namespace kerf::zwidth
