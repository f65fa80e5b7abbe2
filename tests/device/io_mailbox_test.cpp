// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/io_mailbox.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

namespace {

using Bytes = std::array<std::uint8_t, kerf::MailboxPacket::kMaxBytes>;

/// A packet that says who sent it and its number, again and again to its end.
std::array<std::uint8_t, 16> packet(std::uint8_t sender, int number) {
  std::array<std::uint8_t, 16> bytes{};
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    bytes[i] = sender;
    for (std::size_t k = 1; k < 4; ++k)
      bytes[i + k] = static_cast<std::uint8_t>(number >> 8 * (k - 1));
  }
  return bytes;
}
int number_of(const Bytes& bytes) {
  return bytes[1] | bytes[2] << 8 | bytes[3] << 16;
}
bool is_whole(const Bytes& bytes) {
  return std::ranges::equal(std::span(bytes).first(16), packet(bytes[0], number_of(bytes)));
}

}  // namespace

TEST_CASE("an inbox gives packets in their order and tells when it is full") {
  kerf::SpscRing inbox;
  Bytes out{};
  CHECK(inbox.take(out) == 0);
  int put = 0;
  while (inbox.put(packet(1, put))) ++put;
  CHECK(put == 64);
  for (int i = 0; i < put; ++i) {
    CHECK(inbox.take(out) == 16);
    CHECK(out[1] == i);
  }
  CHECK(inbox.empty());
}

TEST_CASE("a packet longer than the reader's room is cut, and its size told") {
  kerf::SpscRing inbox;
  CHECK(inbox.put(packet(1, 2)));
  std::array<std::uint8_t, 4> little{};
  CHECK(inbox.take(little) == 16);
  CHECK(little[1] == 2);
}

TEST_CASE("an outbox gives the newest packet, and what is older is void") {
  kerf::LatestCommand outbox;
  Bytes out{};
  CHECK(outbox.take(out) == 0);
  for (const int waiting : {1, 3, 8}) {
    for (int i = 0; i < waiting; ++i) {
      CHECK(outbox.put(packet(1, static_cast<std::uint8_t>(i))));
    }
    CHECK_FALSE(outbox.empty());
    CHECK(outbox.take(out) == 16);
    CHECK(out[1] == waiting - 1);
    CHECK(outbox.empty());
    CHECK(outbox.take(out) == 0);
  }
}

TEST_CASE("a reader that was held up for 50 ticks sends nothing of these but the last") {
  kerf::LatestCommand outbox;
  Bytes out{};
  for (std::uint8_t tick = 0; tick < 50; ++tick) CHECK(outbox.put(packet(1, tick)));
  CHECK(outbox.take(out) == 16);
  CHECK(out[1] == 49);
  CHECK(outbox.take(out) == 0);
}

TEST_CASE("packets of several threads reach the reader whole, each thread's in its order") {
  constexpr int kSenders = 3, kEach = 20'000;
  kerf::LatestCommand outbox;
  std::atomic<int> sending{kSenders};
  std::vector<std::thread> senders;
  for (int sender = 0; sender < kSenders; ++sender) {
    senders.emplace_back([&, sender] {
      for (int i = 0; i < kEach;) {
        if (outbox.put(packet(static_cast<std::uint8_t>(sender), i))) ++i;
      }
      --sending;
    });
  }
  std::array<int, kSenders> last{-1, -1, -1};
  int torn = 0, out_of_order = 0;
  Bytes out{};
  for (bool more = true; more;) {
    more = sending > 0;  // before the last look
    while (outbox.take(out) > 0) {
      if (!is_whole(out)) ++torn;
      int& before = last[out[0]];
      if (number_of(out) <= before) ++out_of_order;
      before = number_of(out);
    }
    std::this_thread::yield();
  }
  for (std::thread& sender : senders) sender.join();
  CHECK(torn == 0);
  CHECK(out_of_order == 0);
  CHECK(std::ranges::max(last) == kEach - 1);  // the very last packet has come
}
