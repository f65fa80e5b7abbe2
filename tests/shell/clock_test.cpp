// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "controller/loop/tick_source.hpp"

TEST_CASE("deadlines keep their distance, and missed ones are skipped and counted") {
  constexpr std::int64_t kPeriodNs = 2'000'000;
  kerf::DeadlineClock clock(kPeriodNs, 0);
  const std::int64_t began = kerf::monotonic_ns();
  for (int i = 0; i < 20; ++i) CHECK(clock.wait_next() >= 0);
  // Never early: twenty deadlines take at least twenty periods, less the start.
  CHECK(kerf::monotonic_ns() - began >= 19 * kPeriodNs);

  const std::uint64_t before = clock.overruns();
  const std::int64_t busy_until = kerf::monotonic_ns() + 10 * kPeriodNs;
  while (kerf::monotonic_ns() < busy_until) {
  }
  const std::int64_t back = kerf::monotonic_ns();
  static_cast<void>(clock.wait_next());
  CHECK(clock.overruns() - before >= 8);
  // Not caught up in a burst: the first deadline is less than a period ago, two more follow it.
  static_cast<void>(clock.wait_next());
  static_cast<void>(clock.wait_next());
  CHECK(kerf::monotonic_ns() - back >= kPeriodNs);
}
