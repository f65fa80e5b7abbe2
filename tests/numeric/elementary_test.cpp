// SPDX-License-Identifier: Apache-2.0
// Elementary functions of load time against those of long double, which has 11 bits more.
#include "shared/numeric/elementary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <doctest/doctest.h>

namespace kerf::elementary_test {
namespace {

/// How far `found` is from `exact`, in units of its last place.
double ulps(double found, long double exact) {
  const auto nearest = static_cast<double>(exact);
  const double step = std::nextafter(std::abs(nearest), std::numeric_limits<double>::infinity()) -
                      std::abs(nearest);
  return static_cast<double>(std::abs(found - exact) / step);
}

}  // namespace

TEST_CASE("elementary functions are within 0.51 units in the last place") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  double sines = 0, arcs = 0, lengths = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double angle = unit(random) * (i % 3 == 0 ? 1e6 : 7);
    sines = std::max({sines, ulps(sine(angle), std::sin(static_cast<long double>(angle))),
                      ulps(cosine(angle), std::cos(static_cast<long double>(angle)))});
    const long double y = unit(random) * power_of_tenth(i % 12), x = unit(random) * 10;
    const double c = unit(random);
    arcs = std::max({arcs,
                     ulps(arctangent(static_cast<double>(y), static_cast<double>(x)),
                          std::atan2(static_cast<long double>(static_cast<double>(y)), x)),
                     ulps(arccosine(c), std::acos(static_cast<long double>(c)))});
    lengths = std::max(lengths,
                       ulps(hypotenuse(angle, c), std::hypot(static_cast<long double>(angle), c)));
  }
  CHECK(sines < 0.51);
  CHECK(arcs < 0.51);
  CHECK(lengths < 1.5);
}

TEST_CASE("ends of the ranges") {
  constexpr double kPi = 3.141592653589793;
  CHECK(sine(0) == 0);
  CHECK(cosine(0) == 1);
  CHECK(std::abs(sine(kPi) - 1.2246467991473532e-16) < 1e-31);
  CHECK(arctangent(0, 0) == 0);
  CHECK(arctangent(0, 1) == 0);
  CHECK(arctangent(0, -1) == kPi);
  CHECK(arctangent(-1, 0) == -kPi / 2);
  CHECK(arctangent(1e-300, 1) == 1e-300);
  CHECK(arccosine(1) == 0);
  CHECK(arccosine(-1) == kPi);
  CHECK(arccosine(0) == kPi / 2);
  CHECK(hypotenuse(3, 4) == 5);
  CHECK(hypotenuse(2, 3, 6) == 7);
  CHECK(power_of_tenth(3) == 1e-3);
  CHECK(power_of_tenth(-22) == 1e22);
  CHECK(power_of_tenth(2'000'000'000) == 0);
}

}  // namespace kerf::elementary_test
