// SPDX-License-Identifier: Apache-2.0
#include "controller/stability/passive_limits.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace kerf {
namespace {

/// (T/2) Re[(1 - 1/z) z^-d H(z)] / (1 - cos w) at z = e^jw.
double viscosity_at(const SampledLoop& loop, double stiffness, double damping, double w) {
  const double lag = loop.velocity_filter_s / loop.period_s;
  const double delay = loop.delay_s / loop.period_s;
  // 1 - 1/z = 2 j sin(w/2) e^-jw/2 and 1 - cos w = 2 sin^2(w/2): nothing cancels at small w.
  const double sine = std::sin(w / 2);
  const std::complex<double> step(2 * sine * sine, 2 * sine * std::cos(w / 2));  // 1 - 1/z
  const std::complex<double> velocity = step / (1.0 + lag * step) / loop.period_s;
  const std::complex<double> force = (stiffness + damping * velocity) * std::polar(1.0, -w * delay);
  return loop.period_s / 2 * (step * force).real() / (2 * sine * sine);
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

double undelayed_passive_viscosity(const SampledLoop& loop, double stiffness_n_per_mm,
                                   double damping_ns_per_mm) {
  const double period = loop.period_s;
  return stiffness_n_per_mm * period / 2 +
         damping_ns_per_mm * period / (period + 2 * loop.velocity_filter_s);
}

double passive_stiffness(const SampledLoop& loop, double damping_ns_per_mm) {
  const auto passive = [&](double stiffness) {
    return passive_viscosity(loop, stiffness, damping_ns_per_mm) <= loop.viscous_ns_per_mm;
  };
  if (!passive(0)) return 0;
  // At small w the stiffness asks for K (T/2 + td), so no more than this is passive.
  double low = 0, high = short_delay_stiffness(loop, damping_ns_per_mm);
  constexpr int kBits = 50;
  for (int i = 0; i < kBits; ++i) {
    const double middle = (low + high) / 2;
    (passive(middle) ? low : high) = middle;
  }
  return low;
}

double short_delay_stiffness(const SampledLoop& loop, double damping_ns_per_mm) {
  return (loop.viscous_ns_per_mm + damping_ns_per_mm) / (loop.period_s / 2 + loop.delay_s);
}

double quantum_stiffness(const SampledLoop& loop) {
  const double held = loop.quantum_mm > 0 ? 2 * loop.coulomb_n / loop.quantum_mm
                                          : std::numeric_limits<double>::infinity();
  return std::min(2 * loop.viscous_ns_per_mm / loop.period_s, held);
}

}  // namespace kerf
