// SPDX-License-Identifier: Apache-2.0
// The mailboxes between the servo and a port's thread, and the turns of host and device on USB.
#include "controller/device/port/io_mailbox.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

namespace kerf::io_mailbox_test {
namespace {

using Bytes = std::array<std::uint8_t, kerf::MailboxPacket::kMaxBytes>;

/// A packet that repeats its sender and its number to its end.
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

TEST_CASE("an inbox gives packets in their order and reports that it is full") {
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
  CHECK(inbox.put(packet(1, 2)));
  std::array<std::uint8_t, 4> little{};
  CHECK(inbox.take(little) == 16);  // cut to the room, and its size reported
  CHECK(little[1] == 2);
}

TEST_CASE("an outbox gives the newest packet, and older ones are void") {
  kerf::LatestCommand outbox;
  Bytes out{};
  CHECK(outbox.take(out) == 0);
  for (const int waiting : {1, 3, 50}) {
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
    more = sending > 0;  // before the last read
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

TEST_CASE("turns: the host begins, and goes on with each answer") {
  Turns turns;
  for (std::int64_t now_ns = 1'000; now_ns < 10'000; now_ns += 1'000) {
    CHECK(turns.ours(now_ns));
    turns.sent(now_ns);
    CHECK_FALSE(turns.ours(now_ns));
    turns.answered();
  }
}

TEST_CASE("turns: a lost answer costs one turn") {
  Turns turns;
  turns.sent(0);
  CHECK_FALSE(turns.ours(Turns::kPatienceNs - 1));
  CHECK(turns.ours(Turns::kPatienceNs));
  turns.sent(Turns::kPatienceNs);
  CHECK_FALSE(turns.ours(Turns::kPatienceNs));
  turns.answered();
  CHECK(turns.ours(Turns::kPatienceNs));
}

TEST_CASE("turns: a command out of turn is waited for as well") {
  Turns turns;
  turns.sent(0);
  turns.sent(1);
  turns.answered();
  CHECK_FALSE(turns.ours(2));
  turns.answered();
  CHECK(turns.ours(2));
  turns.answered();  // of a turn that was given up
  turns.sent(3);
  CHECK_FALSE(turns.ours(4));
}

}  // namespace kerf::io_mailbox_test
