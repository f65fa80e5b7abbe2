// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include "tests/studies/contact/hands.hpp"

namespace kerf::hand_run_test {

using namespace kerf::extremes;

namespace {

/// A force of 1 N along y with a wave on it along z; out of contact in the first `air` ticks.
HandRun pressed(double wave_n, double wave_hz, int air = 0) {
  HandRun run;
  for (int i = 0; i < 1000; ++i) {
    HandTick tick;
    tick.force_n = {0, 1, wave_n * std::sin(2 * std::numbers::pi * wave_hz * i / run.rate_hz)};
    tick.contact = i >= air;
    run.ticks.push_back(tick);
  }
  return run;
}

}  // namespace

TEST_CASE("chatter is the rms above the cutoff over the mean force") {
  constexpr double kCutoffHz = 150;
  for (const double wave_hz : {200.0, 320.0, 487.0}) {
    const Chatter chatter = chatter_of(pressed(0.03, wave_hz), kCutoffHz);
    CHECK(chatter.windows == 14);
    CHECK(chatter.share == doctest::Approx(0.03 / std::sqrt(2.0)).epsilon(0.01));
    CHECK(chatter.worst == doctest::Approx(chatter.share).epsilon(0.01));
  }
}

TEST_CASE("what is slow is no chatter, however strong") {
  CHECK(chatter_of(pressed(0.5, 20), 150).share < 1e-3);
  CHECK(chatter_of(pressed(0.5, 0.7), 150).share < 1e-3);
}

TEST_CASE("only windows wholly in contact count") {
  CHECK(chatter_of(pressed(0.03, 300, 500), 150).windows == 6);
  CHECK(chatter_of(pressed(0.03, 300, 900), 150).windows == 0);
  CHECK(chatter_of(pressed(0.03, 300, 900), 150).share == 0);
  CHECK(chatter_of({}, 150).windows == 0);
}

}  // namespace kerf::hand_run_test
