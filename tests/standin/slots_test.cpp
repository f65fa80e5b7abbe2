// SPDX-License-Identifier: Apache-2.0
#include "standin/dhd/slots.hpp"

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

namespace kerf::slots_test {

using kerf::dhd::Slots;

TEST_CASE("commands at one time, of any number of threads, get slots one after the other") {
  constexpr int kThreads = 8, kEach = 500;
  constexpr std::int64_t kPeriodNs = 250'000;
  Slots slots(kPeriodNs);
  std::mutex mutex;
  std::vector<std::int64_t> at_ns;
  const auto work = [&] {
    for (int i = 0; i < kEach; ++i) {
      const std::lock_guard lock(mutex);  // as the library's
      const Slots::Slot slot = slots.take(1000);
      CHECK(slot.missed == 0);
      at_ns.push_back(slot.at_ns);
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  std::sort(at_ns.begin(), at_ns.end());
  REQUIRE(at_ns.size() == kThreads * kEach);
  for (std::size_t i = 0; i < at_ns.size(); ++i) {
    REQUIRE(at_ns[i] == 1000 + static_cast<std::int64_t>(i) * kPeriodNs);
  }
}

TEST_CASE("commands and missed slots together are the slots that have begun") {
  constexpr std::int64_t kPeriodNs = 100;
  Slots slots(kPeriodNs);
  std::int64_t now_ns = 5000, commands = 0, missed = 0;
  for (const std::int64_t pause_ns : {0, 100, 100, 99, 101, 350, 0, 0, 0, 1000, 7, 450}) {
    now_ns += pause_ns;
    const Slots::Slot slot = slots.take(now_ns);
    CHECK(slot.at_ns >= now_ns);
    now_ns = slot.at_ns;
    ++commands;
    missed += slot.missed;
    CHECK(commands + missed == (now_ns - 5000) / kPeriodNs + 1);
  }
  CHECK(missed > 0);
}

TEST_CASE("a command within its slot leaves at once, and the next slot is not later for that") {
  Slots slots(100);
  CHECK(slots.take(1000).at_ns == 1000);
  CHECK(slots.take(1180).at_ns == 1180);  // the slot of 1100
  CHECK(slots.take(1181).at_ns == 1200);
  const Slots::Slot late = slots.take(1599);  // 1300 and 1400 are over
  CHECK(late.at_ns == 1599);
  CHECK(late.missed == 2);
}

}  // namespace kerf::slots_test
