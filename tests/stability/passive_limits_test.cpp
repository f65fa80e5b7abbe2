// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include "controller/stability/sampled_loop.hpp"

namespace kerf::passive_limits_test {
namespace {

SampledLoop at_1_khz() {
  SampledLoop loop;
  loop.period_s = 0.001;
  return loop;
}

}  // namespace

TEST_CASE("a passive wall needs K T/2 + B of damping") {  // S7
  CHECK(std::abs(1000 * kerf::passive_viscosity(at_1_khz(), 1, 0.001) - 1.5) < 1e-6);
  CHECK(std::abs(1000 * kerf::passive_viscosity(at_1_khz(), 0, 0.002) - 2) < 1e-6);
  CHECK(std::abs(1000 * kerf::passive_viscosity(at_1_khz(), 2, 0.005) - 6) < 1e-6);
}

TEST_CASE("a velocity filter lowers what a passive wall needs") {  // S8
  const std::array<std::array<double, 2>, 4> rows{
      {{0, 2.5}, {0.001, 1.16667}, {0.003, .785714}, {0.005, .681818}}};
  for (const auto& [filter_s, needed] : rows) {
    SampledLoop loop = at_1_khz();
    loop.velocity_filter_s = filter_s;
    CAPTURE(filter_s);
    CHECK(std::abs(1000 * kerf::passive_viscosity(loop, 1, 0.002) - needed) < 1e-5);
    const double closed = 0.001 / 2 + 0.002 * 0.001 / (0.001 + 2 * filter_s);
    CHECK(std::abs(kerf::passive_viscosity(loop, 1, 0.002) - closed) < 1e-8);
  }
}

TEST_CASE("delay asks for the stiffness times a period more, and for what a part of one gives") {
  for (const double delay : {0.0, 0.25, 0.5, 1.0, 2.5, 7.0}) {
    CAPTURE(delay);
    SampledLoop loop = at_1_khz();
    loop.delay_s = delay * loop.period_s;
    const double part = delay - std::floor(delay), late = 0.5 + delay;
    const double needed = (late + std::sqrt(late * late + part * (1 - part))) / 2;
    CHECK(1000 * kerf::passive_viscosity(loop, 1, 0) == doctest::Approx(needed).epsilon(1e-6));
  }
}

TEST_CASE("less damping than a passive wall needs lets a hand gain, enough lets none") {
  // Work over one turn of a hand that moves on a sine at the samples and is free at the moment
  // between two of them at which the force changes; straight in between, where damping takes least.
  constexpr int kTurn = 48;
  const double part = 0.5, period = 0.001, stiffness = 1, viscous_enough = [&] {
    SampledLoop loop = at_1_khz();
    loop.delay_s = part * period;
    return kerf::passive_viscosity(loop, stiffness, 0);
  }();
  const auto left_over = [&](double viscous, int waves, double swerve) {
    const auto place = [&](int k) {
      return std::sin(2 * std::numbers::pi * waves * (k + kTurn) / kTurn);
    };
    double taken = 0, given = 0;
    for (int k = 0; k < kTurn; ++k) {
      const double before = -stiffness * place(k - 1), after = -stiffness * place(k);
      const double move = place(k + 1) - place(k);
      const double first = part * move + swerve * (before - after), second = move - first;
      taken += viscous * (first * first / part + second * second / (1 - part)) / period;
      given += before * first + after * second;
    }
    return taken - given;
  };
  double least = 1, most_lost = 0;
  for (int waves = 1; waves <= kTurn / 2; ++waves) {
    for (double swerve = -0.5; swerve <= 0.5; swerve += 0.001) {
      least = std::min(least, left_over(viscous_enough, waves, swerve));
      most_lost = std::min(most_lost, left_over(0.98 * viscous_enough, waves, swerve));
    }
  }
  CHECK(least >= -1e-12);
  CHECK(most_lost < 0);
  CHECK(left_over(stiffness * 1.0 * period, 1, 0) > 0);  // who goes straight finds nothing there
}

TEST_CASE("the passive stiffness is where the device's damping just does, and is stable") {
  SampledLoop loop = at_1_khz();
  loop.viscous_ns_per_mm = 0.0012;
  CHECK(kerf::passive_stiffness(loop, 0) == doctest::Approx(2.4));
  CHECK(kerf::passive_stiffness(loop, 0.0005) == doctest::Approx(1.4));
  CHECK(kerf::passive_stiffness(loop, 0.002) == 0);
  CHECK(kerf::highest_stiffness(loop, 0.0005) > kerf::passive_stiffness(loop, 0.0005));
}

TEST_CASE("friction bounds what quantisation may give") {
  SampledLoop loop = at_1_khz();
  loop.viscous_ns_per_mm = 0.1;
  loop.coulomb_n = 0.26;
  loop.quantum_mm = 0.055;
  CHECK(kerf::quantum_stiffness(loop) == doctest::Approx(2 * 0.26 / 0.055));
  loop.quantum_mm = 0;
  CHECK(kerf::quantum_stiffness(loop) == doctest::Approx(200));
}

}  // namespace kerf::passive_limits_test
