// SPDX-License-Identifier: Apache-2.0
// Elementary functions of the emulated mechanics against those of long double.
#include "shared/numeric/quick_elementary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <doctest/doctest.h>

namespace kerf::quick_elementary_test {
namespace {

/// How far `found` is from `exact`, in units of its last place.
double ulps(double found, long double exact) {
  const auto nearest = static_cast<double>(exact);
  const double step = std::nextafter(std::abs(nearest), std::numeric_limits<double>::infinity()) -
                      std::abs(nearest);
  return static_cast<double>(std::abs(found - exact) / step);
}

}  // namespace

TEST_CASE("quick elementary functions are within 4 units in the last place, sines within 2e-16") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  long double sines = 0;
  double arcs = 0, powers = 0, roots = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double angle = unit(random) * (i % 3 == 0 ? 1e4 : 7);
    const long double exact = angle;
    sines = std::max({sines, std::abs(quick::sine(angle) - std::sin(exact)),
                      std::abs(quick::cosine(angle) - std::cos(exact))});
    const double y = unit(random) * std::pow(10.0, i % 12 - 6), x = unit(random), c = unit(random);
    arcs = std::max({arcs, ulps(quick::arctangent(y, x), std::atan2(y + 0.0L, x + 0.0L)),
                     ulps(quick::arccosine(c), std::acos(c + 0.0L))});
    const double e = 40 * unit(random), small = unit(random) * std::pow(10.0, -(i % 9));
    powers = std::max({powers, ulps(quick::exponential(e), std::exp(e + 0.0L)),
                       ulps(quick::growth(small), std::expm1(small + 0.0L))});
    const double any = std::exp(e);
    roots = std::max(roots, ulps(quick::cube_root(any), std::cbrt(any + 0.0L)));
  }
  CHECK(sines < 2e-16L);
  CHECK(arcs < 3);
  CHECK(powers < 4);
  CHECK(roots < 2);
}

TEST_CASE("quick elementary functions at the ends of their ranges") {
  constexpr double kPi = 3.141592653589793;
  CHECK(quick::sine(0) == 0);
  CHECK(quick::cosine(0) == 1);
  CHECK(quick::sine(kPi / 2) == 1);
  CHECK(quick::arctangent(0, 0) == 0);
  CHECK(quick::arctangent(0, -1) == kPi);
  CHECK(quick::arctangent(-1, 0) == -kPi / 2);
  CHECK(quick::arccosine(1) == 0);
  CHECK(quick::arccosine(-1) == kPi);
  CHECK(quick::exponential(0) == 1);
  CHECK(quick::exponential(-1e9) == 0);
  CHECK(std::isinf(quick::exponential(1e9)));
  CHECK(quick::growth(0) == 0);
  CHECK(quick::growth(1e-20) == 1e-20);
  CHECK(quick::cube_root(0) == 0);
  CHECK(quick::cube_root(27) == doctest::Approx(3));
}

}  // namespace kerf::quick_elementary_test
