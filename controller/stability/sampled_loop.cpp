// SPDX-License-Identifier: Apache-2.0

#include "controller/stability/sampled_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "controller/stability/axis_simulation.hpp"

namespace kerf {
namespace {

/// 1 - 1/z at z = e^jw, as 2 j sin(w/2) e^-jw/2: nothing cancels at small w.
std::complex<double> step_at(double w) {
  const double sine = std::sin(w / 2);
  return {2 * sine * sine, 2 * sine * std::cos(w / 2)};
}

/// H of the wall, N/mm: -F over x, by `step` = 1 - 1/z.
std::complex<double> law_at(const SampledLoop& loop, double stiffness, double damping,
                            std::complex<double> step) {
  const double lag = loop.velocity_filter_s / loop.period_s;
  return stiffness + damping * (step / (1.0 + lag * step) / loop.period_s);
}

/// Damping that motion of the angle w needs (docs/forces.md 5.7), at z = e^jw.
double viscosity_at(const SampledLoop& loop, double stiffness, double damping, double w) {
  const double delay = std::min(loop.delay_s / loop.period_s, kMaxDelayPeriods);
  const double whole = std::floor(delay), part = delay - whole;
  const std::complex<double> step = step_at(w);
  const std::complex<double> force = law_at(loop, stiffness, damping, step);
  const std::complex<double> mean = std::polar(1.0, -w * whole) * (1.0 - part * step) * force;
  const double held = (step * mean).real() / std::norm(step);  // 2 (1 - cos w) = |1 - 1/z|^2
  return loop.period_s / 2 * (held + std::sqrt(held * held + part * (1 - part) * std::norm(force)));
}

/// (b + B) / (T/2 + td): Gil's bound for small b and B and a short delay; with B = 0 Diolaiti's.
double short_delay_stiffness(const SampledLoop& loop, double damping_ns_per_mm) {
  return (loop.viscous_ns_per_mm + damping_ns_per_mm) / (loop.period_s / 2 + loop.delay_s);
}

/// Gains between which a loop is stable, in the gain's unit.
struct StableBand {
  double from = 0;
  double to = 0;
};

/// Coefficients from the constant one up.
using Polynomial = std::vector<double>;

Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial p(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) p[i + j] += a[i] * b[j];
  }
  return p;
}

/// a + gain b.
Polynomial sum(const Polynomial& a, const Polynomial& b, double gain) {
  Polynomial p(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < a.size(); ++i) p[i] += a[i];
  for (std::size_t i = 0; i < b.size(); ++i) p[i] += gain * b[i];
  return p;
}

/// Whether all roots lie inside the unit circle (Schur and Cohn): each step removes one degree.
bool all_inside(Polynomial p) {
  while (p.size() > 1) {
    const double share = p.front() / p.back();
    if (!(std::abs(share) < 1)) return false;
    const std::size_t n = p.size() - 1;
    Polynomial next(n);
    for (std::size_t i = 0; i < n; ++i) next[i] = p[i + 1] - share * p[n - 1 - i];
    p = std::move(next);
  }
  return true;
}

/// The loop's characteristic polynomial in z, open + K stiffness + B damping. Plant, hold and delay
/// make x = N/(z^D P) F, the wall F = -(K + B (z - 1)/(T W)) x with W = (1 + tau/T) z - tau/T, and
/// so z^D P W + N (K W + (B/T) (z - 1)) = 0.
struct Characteristic {
  Polynomial open, stiffness, damping;
  Polynomial still;  ///< of K = 0, over the root z = 1 that a free mass has: `still` + B `plant`
  Polynomial plant;
};

/// (z I - free)^-1 driven, first row, over the plant's own polynomial.
Polynomial numerator(const HoldResponse& whole, const std::array<double, 2>& driven) {
  return {whole.free[0][1] * driven[1] - whole.free[1][1] * driven[0], driven[0]};
}

Characteristic characteristic(const SampledLoop& loop) {
  const double delay = std::min(loop.delay_s / loop.period_s, kMaxDelayPeriods);
  constexpr double kWhole = 1e-9;  // error of a quotient of two decimals near a whole number
  double ticks = std::floor(delay + kWhole);
  const double part = delay - ticks > kWhole ? delay - ticks : 0;

  const HoldResponse whole = held_mass(loop, 1);
  // The force of the tick before acts for `part` of a period, then the new one.
  const HoldResponse before = held_mass(loop, part), after = held_mass(loop, 1 - part);
  const auto& [a, b] = after.free;
  const std::array<double, 2> old{a[0] * before.driven[0] + a[1] * before.driven[1],
                                  b[0] * before.driven[0] + b[1] * before.driven[1]};
  const auto& [f, g] = whole.free;
  const Polynomial own{f[0] * g[1] - f[1] * g[0], -f[0] - g[1], 1};

  // Without a part of a period the old force does not act, and one factor z falls out.
  Polynomial plant = numerator(whole, after.driven);
  if (part > 0) {
    plant = sum(product(plant, {0, 1}), numerator(whole, old), 1);
    ticks += 1;
  }
  Polynomial shift(static_cast<std::size_t>(ticks) + 1);
  shift.back() = 1;
  const double lag = loop.velocity_filter_s / loop.period_s;
  const Polynomial filter = lag > 0 ? Polynomial{-lag, 1 + lag} : Polynomial{0, 1};

  Characteristic c;
  c.open = product(product(shift, own), filter);
  c.stiffness = product(plant, filter);
  c.damping = product(plant, {-1 / loop.period_s, 1 / loop.period_s});
  // own = (z - 1)(z - e^-delta) for a free mass; its second root is the decay of the speed.
  c.still = product(product(shift, {-g[1], 1}), filter);
  c.plant = plant;
  for (double& p : c.plant) p /= loop.period_s;
  return c;
}

/// Beyond this gain no root configuration inside the circle has such coefficients: of a monic
/// polynomial of degree n with all roots inside, |a_i| < C(n, i).
double top_gain(const Polynomial& open, const Polynomial& gained) {
  const std::size_t n = open.size() - 1;
  double top = std::numeric_limits<double>::infinity();
  double choose = 1;  // C(n, i)
  for (std::size_t i = n; i-- > 0;) {
    choose = choose * static_cast<double>(i + 1) / static_cast<double>(n - i);
    if (i >= gained.size() || gained[i] == 0) continue;
    top = std::min(top, (choose * open.back() + std::abs(open[i])) / std::abs(gained[i]));
  }
  return top;
}

/// The gains g > 0 for which open + g gained has all roots inside, from the lowest up. The first
/// band begins at 0 unless `open` alone is unstable; later ones are re-entries. Empty: never
/// stable.
std::vector<StableBand> bands(const Polynomial& open, const Polynomial& gained) {
  constexpr double kLowest = 1e-9, kRatio = 1.02;
  const double top = top_gain(open, gained);
  const auto stable = [&](double gain) { return all_inside(sum(open, gained, gain)); };
  const auto border = [&](double low, double high) {
    const bool below = stable(low);
    constexpr int kBits = 50;
    for (int i = 0; i < kBits; ++i) {
      const double middle = (low + high) / 2;
      (stable(middle) == below ? low : high) = middle;
    }
    return (low + high) / 2;
  };
  std::vector<StableBand> found;
  double last = top * kLowest;
  bool inside = stable(last);
  double from = 0;
  while (last < top) {
    const double next = last * kRatio;
    const bool now = stable(next);
    if (now != inside) {
      const double at = border(last, next);
      if (inside) found.push_back({from, at});
      from = at;
      inside = now;
    }
    last = next;
  }
  return found;
}

double first_end(const std::vector<StableBand>& found) {
  return found.empty() || found.front().from > 0 ? 0 : found.front().to;
}

}  // namespace

std::complex<double> wall_impedance(const SampledLoop& loop, double stiffness_n_per_mm,
                                    double damping_ns_per_mm, double hz) {
  const double rad_per_s = 2 * std::numbers::pi * hz, w = rad_per_s * loop.period_s;
  const double delay_s = std::min(loop.delay_s, kMaxDelayPeriods * loop.period_s);
  const std::complex<double> step = step_at(w), jw(0, rad_per_s);
  const std::complex<double> held = step / (jw * loop.period_s);
  return std::polar(1.0, -rad_per_s * delay_s) * held *
         law_at(loop, stiffness_n_per_mm, damping_ns_per_mm, step) / jw;
}

std::complex<double> device_impedance(const SampledLoop& loop, double hz, double amplitude_mm) {
  constexpr double kMmPerM = 1000;
  const double rad_per_s = 2 * std::numbers::pi * hz;
  // The fundamental of a force of alternating sign is 4/pi of it.
  const double sliding =
      loop.coulomb_n > 0 ? 4 * loop.coulomb_n / (std::numbers::pi * rad_per_s * amplitude_mm) : 0;
  return {loop.viscous_ns_per_mm + sliding, rad_per_s * loop.mass_kg / kMmPerM};
}

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
  // At small w the stiffness needs a damping of K (T/2 + td) or more, so no more than this is
  // passive.
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

bool is_stable(const SampledLoop& loop, double stiffness_n_per_mm, double damping_ns_per_mm) {
  const Characteristic c = characteristic(loop);
  return all_inside(
      sum(sum(c.open, c.damping, damping_ns_per_mm), c.stiffness, stiffness_n_per_mm));
}

double highest_stiffness(const SampledLoop& loop, double damping_ns_per_mm) {
  const Characteristic c = characteristic(loop);
  return first_end(bands(sum(c.open, c.damping, damping_ns_per_mm), c.stiffness));
}

double highest_damping(const SampledLoop& loop) {
  const Characteristic c = characteristic(loop);
  if (loop.hand.stiffness_n_per_mm > 0) return first_end(bands(c.open, c.damping));
  return first_end(bands(c.still, c.plant));
}

}  // namespace kerf
