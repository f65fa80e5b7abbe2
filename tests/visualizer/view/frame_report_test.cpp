// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/frame_report.hpp"

#include <algorithm>

#include <doctest/doctest.h>
#include <rapidcheck.h>

using namespace kerf;

TEST_CASE("a percentile is the smallest value that so large a share does not exceed") {
  CHECK(rc::check([] {
    const auto values = *rc::gen::nonEmpty(rc::gen::container<std::vector<double>>(
        rc::gen::map(rc::gen::inRange(0, 1000), [](int v) { return v * 0.1; })));
    const double share = *rc::gen::inRange(1, 101) * 0.01;
    const double found = percentile(values, share);
    const auto below = [&](double limit) {
      return static_cast<double>(
          std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; }));
    };
    const double needed = share * static_cast<double>(values.size());
    RC_ASSERT(below(found) >= needed - 1e-9);
    for (const double v : values) RC_ASSERT(v >= found || below(v) < needed - 1e-12);
  }));
  CHECK(percentile({}, 0.5) == 0.0);
}

TEST_CASE("the stopwatch counts processor time while the process works") {
  const Stopwatch watch;
  volatile double sum = 0.0;
  while (watch.cpu_ms() < 5.0) sum = sum + 1.0;
  CHECK(watch.wall_ms() > 0.0);
  CHECK(watch.cpu_ms() >= 5.0);
}
