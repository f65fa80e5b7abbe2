// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/numeric/statistics.hpp"

TEST_CASE("a percentile is the smallest value that so large a share does not exceed") {
  CHECK(rc::check([] {
    auto values = *rc::gen::nonEmpty(rc::gen::container<std::vector<double>>(
        rc::gen::map(rc::gen::inRange(0, 1000), [](int v) { return v * 0.1; })));
    const double share = *rc::gen::inRange(1, 101) * 0.01;
    const double found = kerf::percentile(values, share);
    const auto below = [&](double limit) {
      return static_cast<double>(
          std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; }));
    };
    const double needed = share * static_cast<double>(values.size());
    RC_ASSERT(below(found) >= needed - 1e-9);
    for (const double v : values) RC_ASSERT(v >= found || below(v) < needed - 1e-12);
  }));
  CHECK(kerf::percentile({}, 0.5) == 0.0);
}
