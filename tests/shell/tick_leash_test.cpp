// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <future>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "controller/loop/tick_source.hpp"
#include "tests/support/process.hpp"

using kerf::TickGate;
using kerf::test::TemporaryFolder;

TEST_CASE(
    "a leash holds the ticks that no picture asked for, and lets go of a writer that has gone") {
  const TemporaryFolder folder;
  const std::string fifo = (folder / "lead").string();
  REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
  const std::atomic<bool> stop{false};
  TickGate leash(fifo, stop);
  const int writer = open(fifo.c_str(), O_WRONLY);
  REQUIRE(writer >= 0);
  const auto allow = [&](std::uint64_t tick) {
    REQUIRE(write(writer, &tick, sizeof tick) == sizeof tick);
  };
  allow(3);
  allow(5);  // the last one counts
  for (std::uint64_t tick = 1; tick <= 5; ++tick) leash.wait_for(tick);

  std::atomic<bool> passed{false};
  auto sixth = std::async(std::launch::async, [&] {
    leash.wait_for(6);
    passed = true;
  });
  CHECK(sixth.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
  CHECK_FALSE(passed);
  allow(6);
  sixth.get();

  allow(4);  // less than it had: nothing more is allowed
  auto seventh = std::async(std::launch::async, [&] { leash.wait_for(7); });
  CHECK(seventh.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
  close(writer);
  seventh.get();
  leash.wait_for(1'000'000);
}

TEST_CASE("a leash gives way to the wish to stop, and is a FIFO or refused") {
  const TemporaryFolder folder;
  const std::string fifo = (folder / "lead").string();
  REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
  std::atomic<bool> stop{false};
  TickGate leash(fifo, stop);
  auto waiting = std::async(std::launch::async, [&] { leash.wait_for(1); });
  CHECK(waiting.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
  stop = true;
  waiting.get();

  std::ofstream(folder / "file") << "12345678";
  for (const std::string& wrong : {(folder / "file").string(), (folder / "none").string()}) {
    CHECK_THROWS_WITH_AS(TickGate(wrong, stop),
                         ("--until " + wrong + ": no FIFO; make one with mkfifo").c_str(),
                         std::runtime_error);
  }
}
