// SPDX-License-Identifier: Apache-2.0
// The relay of the two machines: what it does to packets is what it says.
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>

#include "tests/studies/bridge/two_machines.hpp"

namespace kerf::link_test {

using kerf::two_machines::Link;
using kerf::two_machines::LinkSettings;

namespace {

constexpr std::int64_t kMs = 1'000'000;

Link::Packet packet_of(std::size_t bytes) {
  return Link::Packet(bytes);
}

}  // namespace

TEST_CASE("a clean link passes every packet at once and in order") {
  Link link({}, 0);
  for (std::size_t i = 1; i <= 3; ++i) CHECK(link.offer(5, packet_of(i)));
  CHECK(link.next_ns() == 5);
  for (std::size_t i = 1; i <= 3; ++i) CHECK(link.take(5)->size() == i);
  CHECK(!link.take(1000));
  CHECK(!link.next_ns());
}

TEST_CASE("a delay holds a packet that long, however many are on their way") {
  Link link({.delay_ms = 20}, 0);
  CHECK(link.offer(0, packet_of(1)));
  CHECK(link.offer(7 * kMs, packet_of(2)));
  CHECK(!link.take(20 * kMs - 1));
  CHECK(link.take(20 * kMs)->size() == 1);
  CHECK(link.next_ns() == 27 * kMs);
}

TEST_CASE("a rate sends one packet after the other, and a queue of 100 ms drops the rest") {
  // 1,000 bytes at 8 Mbit/s: 1 ms each.
  Link link({.mbit = 8}, 0);
  int kept = 0;
  for (int i = 0; i < 1000; ++i) kept += link.offer(0, packet_of(1000)) ? 1 : 0;
  CHECK(kept == 101);  // the first is on the line; then 100 ms of queue
  for (int i = 1; i <= kept; ++i) {
    CHECK(!link.take(i * kMs - 1));
    CHECK(link.take(i * kMs));
  }
  CHECK(link.offer(500 * kMs, packet_of(1000)));  // an idle line saves nothing up
  CHECK(link.next_ns() == 501 * kMs);
}

TEST_CASE("losses are as many as asked for, and the same for the same seed") {
  const auto losses = [](std::uint64_t seed, std::uint64_t direction) {
    Link link({.loss = 0.05, .seed = seed}, direction);
    std::vector<int> lost;
    for (int i = 0; i < 20'000; ++i) {
      if (!link.offer(i, packet_of(1))) lost.push_back(i);
    }
    return lost;
  };
  const auto first = losses(3, 0);
  CHECK(first.size() > 850);  // 1000, and five deviations of 31
  CHECK(first.size() < 1150);
  CHECK(first == losses(3, 0));
  CHECK(first != losses(4, 0));
  CHECK(first != losses(3, 1));
}

}  // namespace kerf::link_test
