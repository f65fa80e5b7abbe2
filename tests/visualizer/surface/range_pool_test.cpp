// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <random>

#include <doctest/doctest.h>

#include "visualizer/surface/surface_on_gpu.hpp"

using kerf::RangePool;

TEST_CASE("ranges hold what they were asked for, never overlap, and are used again") {
  RangePool pool;
  std::array<RangePool::Range, 40> ranges{};
  std::array<std::uint32_t, 40> counts{};
  std::mt19937 random(2);
  int wrong = 0;
  std::uint32_t size_half_way = 0;
  for (int step = 0; step < 4000; ++step) {
    const std::size_t i = random() % ranges.size();
    counts[i] = static_cast<std::uint32_t>(random() % 4 == 0 ? 0 : random() % 1900);
    ranges[i] = pool.fit(ranges[i], counts[i]);
    for (std::size_t j = 0; j < ranges.size(); ++j) {
      const RangePool::Range& a = ranges[i];
      const RangePool::Range& b = ranges[j];
      wrong += b.capacity < counts[j] || b.first + b.capacity > pool.size() ? 1 : 0;
      wrong += i != j && a.first < b.first + b.capacity && b.first < a.first + a.capacity ? 1 : 0;
    }
    if (step == 2000) size_half_way = pool.size();
  }
  CHECK(wrong == 0);
  CHECK(pool.size() < 1.2 * size_half_way);  // what comes and goes takes no new room
}
