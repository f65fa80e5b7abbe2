// SPDX-License-Identifier: Apache-2.0
#include "controller/stability/passive_limits.hpp"

#include <array>
#include <cmath>

#include <doctest/doctest.h>

#include "controller/stability/stable_gains.hpp"

namespace {

using kerf::SampledLoop;

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
    CHECK(std::abs(1000 * kerf::undelayed_passive_viscosity(loop, 1, 0.002) - needed) < 1e-5);
  }
}

TEST_CASE("each sample of delay asks for the stiffness times a period more") {
  for (const double delay : {0.25, 1.0, 2.5}) {
    SampledLoop loop = at_1_khz();
    loop.delay_s = delay * loop.period_s;
    CHECK(kerf::passive_viscosity(loop, 1, 0) ==
          doctest::Approx(loop.period_s / 2 + loop.delay_s).epsilon(1e-6));
  }
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
