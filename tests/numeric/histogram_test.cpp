// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/numeric/statistics.hpp"

TEST_CASE("percentiles are at most one bucket (3.2 %) above the exact ones, the maximum is exact") {
  CHECK(rc::check([] {
    const auto values = *rc::gen::nonEmpty(rc::gen::container<std::vector<std::int64_t>>(
        rc::gen::inRange<std::int64_t>(0, 1LL << 40)));
    kerf::Histogram histogram;
    for (const auto v : values) histogram.record(v);
    auto sorted = values;
    std::ranges::sort(sorted);
    for (const double q : {0.5, 0.99, 0.999}) {
      const auto rank = static_cast<std::size_t>(
          std::max(0.0, std::ceil(q * static_cast<double>(sorted.size())) - 1));
      const double exact_us = static_cast<double>(sorted[rank]) / 1e3;
      RC_ASSERT(histogram.percentile_us(q) >= exact_us);
      RC_ASSERT(histogram.percentile_us(q) <= exact_us * 1.032 + 1e-3);
    }
    RC_ASSERT(histogram.max_us() == static_cast<double>(sorted.back()) / 1e3);
    RC_ASSERT(histogram.count() == values.size());
  }));
}

TEST_CASE("an empty histogram reads zero and a negative duration counts as zero") {
  kerf::Histogram histogram;
  CHECK(histogram.percentile_us(0.99) == 0);
  histogram.record(-5);
  CHECK(histogram.count() == 1);
  CHECK(histogram.max_us() == 0);
}
