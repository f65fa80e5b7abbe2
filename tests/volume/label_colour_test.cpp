// SPDX-License-Identifier: Apache-2.0
// Seen by three kinds of eyes, after Vienot, Brettel and Mollon (1999).
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "shared/volume/material.hpp"

namespace {

using Row = std::array<double, 3>;
using Matrix = std::array<Row, 3>;

constexpr Matrix kUsual{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr Matrix kNoRed{{{0.11238, 0.88762, 0}, {0.11238, 0.88762, 0}, {0.00401, -0.00401, 1}}};
constexpr Matrix kNoGreen{{{0.29275, 0.70725, 0}, {0.29275, 0.70725, 0}, {-0.02234, 0.02234, 1}}};
constexpr Matrix kXyz{
    {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};

Row times(const Matrix& m, const Row& v) {
  Row out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

/// CIE 1976 L*a*b* of linear RGB.
Row lab(const Row& rgb) {
  const Row white = times(kXyz, {1, 1, 1});
  Row f = times(kXyz, rgb);
  for (std::size_t i = 0; i < 3; ++i) {
    f[i] /= white[i];
    f[i] = f[i] > 0.008856 ? std::cbrt(f[i]) : 7.787 * f[i] + 16.0 / 116;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

double least_difference(const Matrix& eye, std::size_t labels) {
  double least = 1e9;
  for (std::size_t a = 1; a <= labels; ++a) {
    for (std::size_t b = a + 1; b <= labels; ++b) {
      const Row one = lab(times(eye, kerf::label_colour(a)));
      const Row two = lab(times(eye, kerf::label_colour(b)));
      least = std::min(least, std::hypot(one[0] - two[0], one[1] - two[1], one[2] - two[2]));
    }
  }
  return least;
}

}  // namespace

TEST_CASE("any two labels' colours differ for every kind of colour vision") {
  for (const Matrix& eye : {kUsual, kNoRed, kNoGreen}) {
    CHECK(least_difference(eye, 7) > 16);
    CHECK(least_difference(eye, kerf::kLabelColours) > 9);  // 2.3 is just seen
  }
  CHECK(kerf::label_colour(kerf::kLabelColours + 1) == kerf::label_colour(1));
}
