// SPDX-License-Identifier: Apache-2.0
#include "controller/device/io_mailbox.hpp"

#include <array>
#include <cstdint>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

namespace {

using Bytes = std::array<std::uint8_t, kerf::MailboxPacket::kMaxBytes>;

/// A packet that says who sent it, its number, and repeats that to its end.
std::array<std::uint8_t, 16> packet(std::uint8_t sender, std::uint8_t number) {
  std::array<std::uint8_t, 16> bytes{};
  bytes.fill(number);
  bytes[0] = sender;
  return bytes;
}
bool is_whole(const Bytes& bytes) {
  for (std::size_t i = 2; i < 16; ++i) {
    if (bytes[i] != bytes[1]) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("an inbox gives packets in their order and tells when it is full") {
  kerf::Inbox inbox;
  Bytes out{};
  CHECK(inbox.take(out) == 0);
  int put = 0;
  while (inbox.put(packet(1, static_cast<std::uint8_t>(put)))) ++put;
  CHECK(put == 64);
  for (int i = 0; i < put; ++i) {
    CHECK(inbox.take(out) == 16);
    CHECK(out[1] == i);
  }
  CHECK(inbox.empty());
}

TEST_CASE("a packet longer than the reader's room is cut, and its size told") {
  kerf::Inbox inbox;
  CHECK(inbox.put(packet(1, 2)));
  std::array<std::uint8_t, 4> little{};
  CHECK(inbox.take(little) == 16);
  CHECK(little[1] == 2);
}

TEST_CASE("an outbox gives packets in the order of their senders' calls") {
  kerf::Outbox outbox;
  Bytes out{};
  for (std::uint8_t round = 0; round < 5; ++round) {
    for (std::uint8_t i = 0; i < 8; ++i) CHECK(outbox.put(packet(1, i)));
    CHECK_FALSE(outbox.put(packet(1, 9)));
    for (std::uint8_t i = 0; i < 8; ++i) {
      CHECK(outbox.take(out) == 16);
      CHECK(out[1] == i);
    }
    CHECK(outbox.empty());
  }
}

TEST_CASE("packets of several threads reach the reader whole, each thread's in its order") {
  constexpr int kSenders = 3, kEach = 20'000;
  kerf::Outbox outbox;
  std::vector<std::thread> senders;
  for (int sender = 0; sender < kSenders; ++sender) {
    senders.emplace_back([&, sender] {
      for (int i = 0; i < kEach;) {
        if (outbox.put(packet(static_cast<std::uint8_t>(sender), static_cast<std::uint8_t>(i)))) {
          ++i;
        } else {
          std::this_thread::yield();
        }
      }
    });
  }
  std::array<int, kSenders> seen{};
  int torn = 0, out_of_order = 0;
  Bytes out{};
  for (int taken = 0; taken < kSenders * kEach;) {
    if (outbox.take(out) == 0) {
      std::this_thread::yield();
      continue;
    }
    ++taken;
    if (!is_whole(out)) ++torn;
    if (out[1] != static_cast<std::uint8_t>(seen[out[0]]++)) ++out_of_order;
  }
  for (std::thread& sender : senders) sender.join();
  CHECK(torn == 0);
  CHECK(out_of_order == 0);
}
