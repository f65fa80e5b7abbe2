// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <vector>

#include "shared/numeric/percentile.hpp"

namespace kerf {

/// Durations of single ticks, in ns.
struct TickTimes {
  double p50_ns = 0, p99_ns = 0, max_ns = 0;
};

/// Runs `tick(i)` for i = 0 .. ticks - 1 and times each by itself, after `before()`, which is not
/// timed. Twice, and the second time counts: caches and the core's clock have settled. The clock's
/// own 20 to 30 ns are in each figure.
template <class Before, class Tick>
[[nodiscard]] TickTimes time_ticks(int ticks, Before&& before, Tick&& tick) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> ns;
  for (int round = 0; round < 2; ++round) {
    ns.clear();
    for (int i = 0; i < ticks; ++i) {
      before();
      const auto start = Clock::now();
      tick(i);
      ns.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count());
    }
  }
  return {percentile(ns, 0.5), percentile(ns, 0.99), percentile(ns, 1)};
}

}  // namespace kerf
