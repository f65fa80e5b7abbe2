// SPDX-License-Identifier: Apache-2.0
// The cap of samples that a ball's contact with an edge is looked at with.
#include <cmath>
#include <cstddef>

#include <doctest/doctest.h>

#include "controller/kernel/proxy/closeup.hpp"
#include "tests/proxy/support.hpp"

namespace kerf::cap_test {

using namespace kerf::test;

TEST_CASE_TEMPLATE("a cap lies on its ball, wherever it is laid", N, FixedNumbers, DoubleNumbers) {
  constexpr double kBall = 8, kOne = N::kIsFixed ? 32768 : 1;
  const auto& offset = kCapArrays<N>.offset;
  RandomNumbers random(3);
  for (int k = 0; k < 50; ++k) {
    const Point out = k < 2 ? Point{0, 0, k == 0 ? 1.0 : -1.0} : random.direction();
    using Real = typename N::Real;
    const auto rows = cap_rows<N>(normal_of<N>(out), Real(kCapRadius), Real(kBall));
    for (std::size_t i = 0; i < kCapSamples; ++i) {
      Point at = kBall * out;
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          at[a] += kCapRadius * double(rows[a][b]) * double(offset[b][i]) / kOne;
        }
      }
      CHECK(std::abs(length(at) - kBall) < 0.03);
      CHECK(length(at - kBall * out) < kCapRadius + 0.05);
    }
  }
}

TEST_CASE_TEMPLATE("a cap counts on edges, and not on flats", N, FixedNumbers, DoubleNumbers) {
  using Ratio = typename N::Ratio;
  constexpr double kCount = 805, kHeight = 0.5, kSlope = 0.5, kBall = 8;
  const auto sharp = [&](double share) {
    const double weight = share * kCount * std::pow(kHeight, 5) / (10 * kSlope * kBall);
    PointSums<N> sums;
    sums.weight = static_cast<typename N::Sum>(weight * (N::kIsFixed ? 1 << 24 : 1));
    return double(sharpness(sums, 805, Ratio(kHeight), Ratio(kSlope), typename N::Real(kBall)));
  };
  CHECK(sharp(1) == 0);
  CHECK(sharp(0.51) == 0);
  CHECK(sharp(0.425) == doctest::Approx(0.5).epsilon(0.01));
  CHECK(sharp(0.34) == 1);
}

}  // namespace kerf::cap_test
