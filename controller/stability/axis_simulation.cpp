// SPDX-License-Identifier: Apache-2.0

#include "controller/stability/axis_simulation.hpp"

#include <cstddef>

namespace kerf {

HoldResponse held_mass(const SampledLoop& loop, double periods) {
  constexpr double kMmPerM = 1000;
  const double per_n = kMmPerM * loop.period_s * loop.period_s / (loop.mass_kg + loop.hand.mass_kg);
  const double spring = loop.hand.stiffness_n_per_mm * per_n;
  const double damper =
      (loop.viscous_ns_per_mm + loop.hand.damping_ns_per_mm) * per_n / loop.period_s;
  // exp of the 3 x 3 generator of (place, speed, force): Taylor for a short time, then squared.
  using Matrix = std::array<std::array<double, 3>, 3>;
  const auto times = [](const Matrix& a, const Matrix& b) {
    Matrix c{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
      }
    }
    return c;
  };
  double step = periods;
  int halvings = 0;
  for (; (1 + spring + damper + per_n) * step > 0.25; step /= 2) ++halvings;
  const Matrix generator{{{0, step, 0}, {-spring * step, -damper * step, per_n * step}, {0, 0, 0}}};
  const Matrix one{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Matrix whole = one;
  constexpr int kTerms = 14;  // 0.25^14 / 14! < 1e-19
  for (int n = kTerms; n > 0; --n) {
    whole = times(generator, whole);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) whole[i][j] = one[i][j] + whole[i][j] / n;
    }
  }
  for (int i = 0; i < halvings; ++i) whole = times(whole, whole);
  return {{{{whole[0][0], whole[0][1]}, {whole[1][0], whole[1][1]}}}, {whole[0][2], whole[1][2]}};
}

}  // namespace kerf
