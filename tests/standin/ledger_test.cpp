// SPDX-License-Identifier: Apache-2.0
#include "standin/ledger.hpp"

#include <bit>
#include <filesystem>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <unistd.h>

namespace kerf::ledger_test {

using kerf::standin::Ledger;
using kerf::standin::Row;

TEST_CASE("counts of two ledgers of one file add up, and outlive both") {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("ledger-" + std::to_string(getpid()))).string();
  {
    Ledger first(path), second(path);
    first.add(Row::frames, 3);
    second.add(Row::frames);
    second.raise_to(Row::peak_n, 2.5);
    first.raise_to(Row::peak_n, 1.5);
    first.record_period_us(-5);
    second.record_period_us(10'000'000);
  }
  const Ledger third(path);
  CHECK(third.count(Row::frames) == 4);
  CHECK(third.count(Row::ticks) == 0);
  std::filesystem::remove(path);
}

TEST_CASE("without a file, or with one that cannot be, a ledger still counts") {
  for (const char* path : {"", "/nowhere/at/all"}) {
    Ledger ledger(path);
    ledger.record_force_n(2);
    CHECK(ledger.count(Row::commands) == 1);
  }
}

TEST_CASE("sums of two threads lose nothing") {
  Ledger ledger("");
  const auto work = [&] {
    for (int i = 0; i < 20'000; ++i) ledger.sum(Row::square_sum_n2, 1);
  };
  std::thread other(work);
  work();
  other.join();
  CHECK(std::bit_cast<double>(ledger.count(Row::square_sum_n2)) == 40'000);
}

}  // namespace kerf::ledger_test
