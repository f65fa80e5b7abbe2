// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/pulp_heat.hpp"

#include <cmath>
#include <optional>

#include <doctest/doctest.h>

namespace kerf::pulp_heat_test {

namespace {

constexpr HeatingSpindle kSpindle{3, 300};

/// After `seconds` at a load and a speed.
PulpHeat after(double seconds, double rate_hz, std::optional<double> water_c, double load,
               double ratio) {
  PulpHeat pulp(kSpindle, water_c, 1 / rate_hz);
  for (int i = 0; i < int(seconds * rate_hz); ++i) {
    pulp.add(load, ratio);
    pulp.advance();
  }
  return pulp;
}

}  // namespace

TEST_CASE("the spindle's power is torque times speed") {
  // 0.3 N mm at 300,000 rpm: 3e-4 N m * 31416 / s.
  CHECK(kSpindle.power_w(0.1, 1) == doctest::Approx(9.425).epsilon(1e-4));
  CHECK(kSpindle.power_w(0.1, 0.5) == doctest::Approx(4.712).epsilon(1e-4));
}

TEST_CASE("dry, the pulp warms by the work of the spindle and cools never") {
  PulpHeat pulp = after(60, 1000, std::nullopt, 0.05, 1);
  CHECK(pulp.rise_c() == doctest::Approx(0.021 * 60 * kSpindle.power_w(0.05, 1)).epsilon(1e-9));
  CHECK(pulp.harm_s() ==
        doctest::Approx(60 - 5.5 / (0.021 * kSpindle.power_w(0.05, 1))).epsilon(1e-3));
  const double warm_c = pulp.rise_c();
  for (int i = 0; i < 1000; ++i) {
    pulp.add(0, 0);
    pulp.advance();
  }
  CHECK(pulp.rise_c() == warm_c);
  CHECK(pulp.highest_c() == warm_c);
  pulp.restart();
  CHECK(pulp.rise_c() == 0);
  CHECK(pulp.highest_c() == 0);
  CHECK(pulp.harm_s() == 0);
}

TEST_CASE("water draws the pulp to its temperature and the heat of the cut, at every rate") {
  const double exact_c =
      (23 - 37 + 0.021 * kSpindle.power_w(0.05, 1) * 40) * (1 - std::exp(-60.0 / 40));
  for (const double rate_hz : {250.0, 1000.0, 8000.0}) {
    CHECK(after(60, rate_hz, 23, 0.05, 1).rise_c() ==
          doctest::Approx(exact_c).epsilon(1 / (40 * rate_hz)));
  }
  // A spindle at rest has no spray.
  CHECK(after(60, 1000, 10, 0, 0).rise_c() == 0);
}

TEST_CASE("two arms heat one tooth") {
  PulpHeat both(kSpindle, std::nullopt, 0.001);
  for (int i = 0; i < 1000; ++i) {
    both.add(0.05, 1);
    both.add(0.1, 0.5);
    both.advance();
  }
  CHECK(both.rise_c() ==
        doctest::Approx(0.021 * (kSpindle.power_w(0.05, 1) + kSpindle.power_w(0.1, 0.5))));
}

}  // namespace kerf::pulp_heat_test
