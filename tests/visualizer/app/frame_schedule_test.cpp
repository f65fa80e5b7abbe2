// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include <doctest/doctest.h>

#include "visualizer/app/headless.hpp"

using namespace kerf;

namespace {

/// Ticks at which pictures are taken when the state is seen at `seen`, the last one at the end.
std::vector<std::uint64_t> taken_at(std::uint32_t frames, std::uint64_t every,
                                    const std::vector<std::uint64_t>& seen) {
  FrameSchedule schedule(frames, every);
  std::vector<std::uint64_t> taken;
  for (const std::uint64_t ticks : seen) {
    if (!schedule.due(ticks)) continue;
    schedule.take(ticks);
    taken.push_back(ticks);
  }
  while (schedule.final_due(seen.back())) {
    schedule.take(seen.back());
    taken.push_back(seen.back());
  }
  return taken;
}

}  // namespace

TEST_CASE("pictures are evenly spread, and the end of the run is the last one") {
  CHECK(taken_at(4, 10, {1, 5, 10, 15, 21, 29, 33, 37}) ==
        std::vector<std::uint64_t>{10, 21, 33, 37});
  CHECK(taken_at(3, 10, {10, 20, 30, 40, 50}) == std::vector<std::uint64_t>{10, 20, 30});
}

TEST_CASE("pictures missed because drawing was slow are taken late, not left out") {
  CHECK(taken_at(4, 10, {9, 35, 36, 37, 48}) == std::vector<std::uint64_t>{35, 36, 37, 48});
  CHECK(taken_at(5, 10, {9, 50}) == std::vector<std::uint64_t>{50, 50, 50, 50, 50});
}

TEST_CASE("a run that ends before the first picture is due still has one") {
  CHECK(taken_at(5, 100, {3}) == std::vector<std::uint64_t>{3});
}

TEST_CASE("nothing is due before the device is armed, but the end is drawn") {
  FrameSchedule schedule(3, 10);
  CHECK_FALSE(schedule.due(std::nullopt));
  CHECK(schedule.final_due(std::nullopt));
  CHECK(schedule.take(std::nullopt) == 1);
  CHECK_FALSE(schedule.final_due(std::nullopt));
}

TEST_CASE("pictures are spread over the time, else a second apart, also where there are none") {
  constexpr std::uint32_t kTickNs = 1'000'000;
  CHECK(ticks_between(4, 2.0, kTickNs) == 500);
  CHECK(ticks_between(4, std::nullopt, kTickNs) == 1000);
  // In a constant expression a division by zero does not compile.
  static_assert(ticks_between(0, 2.0, kTickNs) == 1000);
  static_assert(ticks_between(9999, 0.0, kTickNs) == 1);
}
