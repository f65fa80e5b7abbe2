// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <doctest/doctest.h>

#include "controller/stability/sampled_loop.hpp"

namespace kerf::impedance_test {

constexpr double kTurn = 2 * std::numbers::pi;

TEST_CASE("a slow hand feels the stiffness, and the damping less that of hold and delay") {
  for (const double delay_s : {0.0, 0.0004, 0.003}) {
    SampledLoop loop;
    loop.period_s = 0.0005;
    loop.delay_s = delay_s;
    const auto z = wall_impedance(loop, 2, 0.003, 0.01);
    CHECK(-kTurn * 0.01 * z.imag() == doctest::Approx(2).epsilon(1e-6));
    CHECK(z.real() == doctest::Approx(0.003 - 2 * (0.00025 + delay_s)).epsilon(1e-6));
  }
}

// docs/forces.md 5.8: by the sum over all aliases of a motion, of a delay of whole periods.
TEST_CASE("the damping that a passive wall needs is that of its least damped sine") {
  for (const double delay : {0.0, 1.0, 3.0}) {
    for (const double filter_s : {0.0, 0.002}) {
      SampledLoop loop;
      loop.delay_s = delay * loop.period_s;
      loop.velocity_filter_s = filter_s;
      double needed = 0;
      for (int i = 1; i < 20000; ++i) {
        const double hz = i * 0.025, half = std::numbers::pi * hz * loop.period_s;
        const double held = std::sin(half) / half;
        needed = std::max(needed, -wall_impedance(loop, 1.5, 0.002, hz).real() / (held * held));
      }
      CAPTURE(delay);
      CHECK(needed == doctest::Approx(passive_viscosity(loop, 1.5, 0.002)).epsilon(1e-4));
    }
  }
}

TEST_CASE("a device is felt as its mass, its damping and the fundamental of its friction") {
  SampledLoop loop;
  loop.mass_kg = 0.2;
  loop.viscous_ns_per_mm = 0.001;
  const auto bare = device_impedance(loop, 5, 0.5);
  CHECK(bare.real() == 0.001);
  CHECK(kTurn * 5 * bare.imag() == doctest::Approx(0.2e-3 * kTurn * 5 * kTurn * 5));  // m w^2
  loop.coulomb_n = 0.3;
  // By its definition: over a period, 2/T INT f sign(v) v dt / amplitude of v.
  CHECK(device_impedance(loop, 5, 0.5).real() - 0.001 ==
        doctest::Approx(4 * 0.3 / (std::numbers::pi * kTurn * 5 * 0.5)));
}

}  // namespace kerf::impedance_test
