// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "controller/device/port/io_mailbox.hpp"

using kerf::Turns;

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
