// SPDX-License-Identifier: Apache-2.0
#include "lab/impedance/stepped_sine.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "controller/stability/sampled_loop.hpp"
#include "hil/hil_error.hpp"
#include "lab/stability/one_axis_wall.hpp"
#include "shared/numeric/quick_elementary.hpp"
#include "shared/text/text.hpp"

namespace kerf::impedance {
namespace {

/// Ticks after which the velocity has forgotten how the motion began: the longest window, and a
/// low-pass down to e^-20, 1e-9.
std::int64_t forgetting_ticks(const SampledLoop& loop) {
  constexpr double kConstants = 20;
  const std::int64_t window = std::int64_t{VelocityWindow<DoubleNumbers>::kIntervals} *
                              VelocityWindow<DoubleNumbers>::kMaxStride;
  return window + std::llround(kConstants * (1 + loop.velocity_filter_s / loop.period_s));
}

template <class N>
Impedance held_force(const zwidth::LoopCase& subject, double stiffness, const SteppedSine& sine,
                     const Stroke& stroke) {
  const SampledLoop& loop = subject.loop;
  const auto phase = [&](std::int64_t tick) {
    const std::int64_t part = (tick % sine.ticks * sine.periods) % sine.ticks;
    return kTurn * static_cast<double>(part) / static_cast<double>(sine.ticks);
  };
  const auto reading_mm = [&](std::int64_t tick) {
    const double tip_mm = stroke.amplitude_mm * quick::cosine(phase(tick)) - stroke.middle_mm;
    if (!(loop.quantum_mm > 0)) return tip_mm;
    return std::floor(tip_mm / loop.quantum_mm) * loop.quantum_mm;
  };
  // The first tick that counts is a whole turn of phases behind tick 0.
  const std::int64_t before = std::min(forgetting_ticks(loop), 16 * sine.ticks);
  const std::int64_t begin = (before + sine.ticks - 1) / sine.ticks * sine.ticks - before;
  zwidth::OneAxisWall<N> wall(subject, stiffness, reading_mm(begin));
  Impedance sum = 0;
  for (std::int64_t i = 0; i < before + sine.ticks; ++i) {
    const double force_n = wall.force(reading_mm(begin + i));
    if (!std::isfinite(force_n)) {
      throw HilError("--law: no number at " + number_text(sine.hz) +
                     " Hz, where the servo would latch a fault; give another one");
    }
    if (i >= before) sum += force_n * std::polar(1.0, -phase(i - before));
  }
  // What a force that is held for a period has at this frequency, from the delay on.
  const Impedance jwt(0, phase(1));
  const Impedance hold =
      std::exp(-jwt * (loop.delay_s / loop.period_s)) * (1.0 - std::exp(-jwt)) / jwt;
  return 2.0 / static_cast<double>(sine.ticks) * sum * hold;
}

}  // namespace

double felt_stiffness(Impedance z, double hz) {
  return -kTurn * hz * z.imag();
}

SteppedSine sine_near(double hz, double rate_hz, std::int64_t least_periods,
                      std::int64_t least_ticks) {
  const double ticks_a_period = rate_hz / hz;
  const auto filling =
      static_cast<std::int64_t>(std::ceil(static_cast<double>(least_ticks) / ticks_a_period));
  const std::int64_t periods = std::max(least_periods, filling);
  std::int64_t ticks = std::llround(static_cast<double>(periods) * ticks_a_period);
  while (std::gcd(periods, ticks) != 1) ++ticks;
  return {rate_hz * static_cast<double>(periods) / static_cast<double>(ticks), periods, ticks};
}

std::optional<Stroke> stroke_at(const zwidth::LoopCase& subject, double stiffness_n_per_mm,
                                double hz, double most_mm) {
  const SampledLoop& loop = subject.loop;
  const double rad_per_s = kTurn * hz;
  SampledLoop at_once = loop;
  at_once.delay_s = 0;
  const double held = std::sin(rad_per_s * loop.period_s / 2) / (rad_per_s * loop.period_s / 2);
  // N/mm of the law itself, without the hold: never below the stiffness.
  const double gain =
      rad_per_s / held *
      std::abs(wall_impedance(at_once, stiffness_n_per_mm, subject.damping_ns_per_mm, hz));
  // The damper of the coupling is in full from this penetration on (docs/forces.md 5.1).
  constexpr double kFullMm = 0.1;
  // A step of the encoder is a speed, and a difference without a window damps it at once.
  const double jump_n =
      subject.estimator.name != "difference"
          ? 0
          : subject.damping_ns_per_mm * loop.quantum_mm / (loop.period_s + loop.velocity_filter_s);
  const double least_mm = loop.quantum_mm + kFullMm + jump_n / stiffness_n_per_mm;
  double amplitude_mm = most_mm;
  if (subject.limits) {
    constexpr double kPart = 0.9;  // of the limits
    const LimitSettings limits;
    const double peak_mm = (kPart * limits.force_n - stiffness_n_per_mm * least_mm) / (2 * gain);
    const double slew_n = kPart * 1000 * limits.slew_n_per_ms * loop.period_s;
    const double slew_mm = slew_n / (gain * 2 * std::sin(rad_per_s * loop.period_s / 2));
    amplitude_mm = std::min({most_mm, peak_mm, slew_mm});
  }
  if (!(amplitude_mm >= kLeastMm)) return std::nullopt;
  // Deep enough that the force has one sign.
  return Stroke{amplitude_mm, least_mm + amplitude_mm * gain / stiffness_n_per_mm};
}

SineResult measure_one_axis(const zwidth::LoopCase& subject, double stiffness_n_per_mm,
                            const SteppedSine& sine, double most_mm) {
  const auto stroke = stroke_at(subject, stiffness_n_per_mm, sine.hz, most_mm);
  if (!stroke) return {sine.hz, most_mm, {}, {}};
  const Impedance force_n =
      subject.numeric == NumericKind::fixed
          ? held_force<FixedNumbers>(subject, stiffness_n_per_mm, sine, *stroke)
          : held_force<DoubleNumbers>(subject, stiffness_n_per_mm, sine, *stroke);
  const Impedance velocity(0, kTurn * sine.hz * stroke->amplitude_mm);
  return {sine.hz, stroke->amplitude_mm, -force_n / velocity, {}};
}

}  // namespace kerf::impedance
