// SPDX-License-Identifier: Apache-2.0
#include "controller/stability/passive_limits.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace kerf {
namespace {

/// What motion of the one angle w takes of damping (docs/theory.md 5.7), at z = e^jw.
double viscosity_at(const SampledLoop& loop, double stiffness, double damping, double w) {
  const double lag = loop.velocity_filter_s / loop.period_s;
  const double delay = std::min(loop.delay_s / loop.period_s, kMaxDelayPeriods);
  const double whole = std::floor(delay), part = delay - whole;
  // 1 - 1/z = 2 j sin(w/2) e^-jw/2 and 1 - cos w = 2 sin^2(w/2): nothing cancels at small w.
  const double sine = std::sin(w / 2);
  const std::complex<double> step(2 * sine * sine, 2 * sine * std::cos(w / 2));  // 1 - 1/z
  const std::complex<double> velocity = step / (1.0 + lag * step) / loop.period_s;
  const std::complex<double> force = stiffness + damping * velocity;
  const std::complex<double> mean = std::polar(1.0, -w * whole) * (1.0 - part * step) * force;
  const double held = (step * mean).real() / (4 * sine * sine);
  return loop.period_s / 2 * (held + std::sqrt(held * held + part * (1 - part) * std::norm(force)));
}

/// (b + B) / (T/2 + td): Gil's bound for small b and B and a short delay; with B = 0 Diolaiti's.
double short_delay_stiffness(const SampledLoop& loop, double damping_ns_per_mm) {
  return (loop.viscous_ns_per_mm + damping_ns_per_mm) / (loop.period_s / 2 + loop.delay_s);
}

}  // namespace

double passive_viscosity(const SampledLoop& loop, double stiffness_n_per_mm,
                         double damping_ns_per_mm) {
  // The integrand has about one wave per tick of delay on half the circle; 64 points each.
  const double waves = 4 + loop.delay_s / loop.period_s;
  const int points = static_cast<int>(64 * std::min(waves, kMaxDelayPeriods));
  const double step = std::numbers::pi / points;
  const auto at = [&](double w) {
    return viscosity_at(loop, stiffness_n_per_mm, damping_ns_per_mm, w);
  };
  double best = 0, best_w = 0;
  for (int i = 0; i <= points; ++i) {
    const double w = std::max(i * step, 1e-4 * step);
    if (at(w) <= best) continue;
    best = at(w);
    best_w = w;
  }
  double low = std::max(best_w - step, 1e-4 * step);
  double high = std::min(best_w + step, std::numbers::pi);
  constexpr int kThirds = 60;
  for (int i = 0; i < kThirds; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (at(a) < at(b) ? low : high) = at(a) < at(b) ? a : b;
  }
  return std::max(best, at((low + high) / 2));
}

double passive_stiffness(const SampledLoop& loop, double damping_ns_per_mm) {
  const auto passive = [&](double stiffness) {
    return passive_viscosity(loop, stiffness, damping_ns_per_mm) <= loop.viscous_ns_per_mm;
  };
  if (!passive(0)) return 0;
  // At small w the stiffness asks for K (T/2 + td) or more, so no more than this is passive.
  double low = 0, high = short_delay_stiffness(loop, damping_ns_per_mm);
  constexpr int kBits = 50;
  for (int i = 0; i < kBits; ++i) {
    const double middle = (low + high) / 2;
    (passive(middle) ? low : high) = middle;
  }
  return low;
}

double quantum_stiffness(const SampledLoop& loop) {
  const double held = loop.quantum_mm > 0 ? 2 * loop.coulomb_n / loop.quantum_mm
                                          : std::numeric_limits<double>::infinity();
  return std::min(2 * loop.viscous_ns_per_mm / loop.period_s, held);
}

}  // namespace kerf
