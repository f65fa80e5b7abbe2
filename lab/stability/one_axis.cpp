// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/one_axis.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "controller/stability/axis_simulation.hpp"
#include "lab/stability/one_axis_wall.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf::zwidth {
namespace {

/// A part of a step, from the seed alone (splitmix64); of seed 0 none.
double shift_of(std::uint64_t seed) {
  if (seed == 0) return 0;
  seed += 0x9E37'79B9'7F4A'7C15;
  seed = (seed ^ (seed >> 30)) * 0xBF58'476D'1CE4'E5B9;
  seed = (seed ^ (seed >> 27)) * 0x94D0'49BB'1331'11EB;
  return static_cast<double>((seed ^ (seed >> 31)) >> 11) * 0x1p-53;
}

template <class N>
LimitCycle hit(const LoopCase& subject, double stiffness, const Press& press, double limit_s,
               std::uint64_t seed, StepCounter& ticks, const SwingWatch& watch) {
  const SampledLoop& loop = subject.loop;
  const double push_n = loop.coulomb_n + press.push_n;
  AxisSimulation axis(loop, shift_of(seed) * loop.quantum_mm);
  axis.start(press.start_mm, -press.hit_mm_per_s);
  OneAxisWall<N> wall(subject, stiffness, axis.encoder_mm());

  constexpr double kRememberedS = 0.2, kFarMm = 1e4;  // no motion comes back from there
  LimitCycleDetector detector(hit_ticks(subject, stiffness, press, limit_s, kRememberedS),
                              loop.quantum_mm, push_n);
  double last_n = 0;
  while (true) {
    const double asked_n = wall.force(axis.encoder_mm());
    if (!std::isfinite(asked_n)) return detector.lost();  // the servo would latch a fault
    axis.tick(asked_n, -push_n);
    ticks.tick();
    if (watch) watch({axis.place_mm(), axis.mm_per_s()});
    if (!(std::abs(axis.place_mm()) < kFarMm)) return detector.lost(kFarMm, axis.motor_work_mj());
    const bool is_held = axis.stuck() && asked_n == last_n;
    last_n = asked_n;
    if (detector.take(axis.place_mm(), axis.motor_work_mj(), is_held)) return detector.verdict();
  }
}

}  // namespace

double slowest_swing_s(const LoopCase& subject, double stiffness_n_per_mm, const Press& press) {
  const SampledLoop& loop = subject.loop;
  const double mass_kg = loop.mass_kg + loop.hand.mass_kg;
  const double n_per_m = 1000 * (stiffness_n_per_mm + loop.hand.stiffness_n_per_mm);
  const double period_s = 2 * std::numbers::pi * std::sqrt(mass_kg / n_per_m);
  const double delay_s = loop.delay_s + loop.period_s;
  const double let_go_s = 2 * LimitSettings().force_n * delay_s / press.push_n;
  constexpr double kLeastMPerS = kHitsMmPerS.back() / 1000;
  const double hit_m_per_s = press.hit_mm_per_s / 1000, start_m = press.start_mm / 1000;
  const double came_m_per_s =
      std::sqrt(hit_m_per_s * hit_m_per_s + 2 * press.push_n * start_m / mass_kg);
  const double impulse_ns = 2 * mass_kg * std::max(kLeastMPerS, came_m_per_s);
  const double left_n = LimitSettings().force_n - press.push_n;  // that the wall turns it back with
  const double flight_s = std::max({let_go_s, impulse_ns / press.push_n,
                                    subject.limits && left_n > 0 ? impulse_ns / left_n : 0});
  constexpr double kLeastS = 0.25;
  return std::max(kLeastS, period_s + flight_s);
}

LimitCycleDetector::Ticks hit_ticks(const LoopCase& subject, double stiffness_n_per_mm,
                                    const Press& press, double limit_s, double remembered_s) {
  const double period_s = subject.loop.period_s;
  constexpr int kSwings = 4;  // two in half a run: its travel is then from peak to peak
  return {
      .limit = std::llround(limit_s / period_s),
      .first =
          std::llround(kSwings * slowest_swing_s(subject, stiffness_n_per_mm, press) / period_s),
      .settled =
          std::llround(remembered_s / period_s) + static_cast<std::int64_t>(kMaxDelayPeriods) +
          VelocityWindow<DoubleNumbers>::kIntervals * VelocityWindow<DoubleNumbers>::kMaxStride};
}

LimitCycle hit_one_axis(const LoopCase& subject, double stiffness_n_per_mm, const Press& press,
                        double limit_s, std::uint64_t seed, StepCounter& ticks,
                        const SwingWatch& watch) {
  return subject.numeric == NumericKind::fixed
             ? hit<FixedNumbers>(subject, stiffness_n_per_mm, press, limit_s, seed, ticks, watch)
             : hit<DoubleNumbers>(subject, stiffness_n_per_mm, press, limit_s, seed, ticks, watch);
}

}  // namespace kerf::zwidth
