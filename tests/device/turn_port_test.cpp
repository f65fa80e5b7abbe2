// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/port/socket_port.hpp"
#include "tests/device/fake_port.hpp"

namespace {

using kerf::Turn;
using Bytes = std::vector<std::uint8_t>;

struct Line {
  kerf::test::FakePort* end = nullptr;
  std::unique_ptr<kerf::LockStepPort> port;

  Line() {
    auto fake = std::make_unique<kerf::test::FakePort>();
    end = fake.get();
    port = std::make_unique<kerf::LockStepPort>(std::move(fake));
  }
  Bytes take() const {
    std::array<std::uint8_t, 64> out{};
    const std::size_t size = port->receive(out);
    return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(std::min(size, out.size()))};
  }
};

Bytes orientation_of(const std::vector<Bytes>& packets) {
  Turn turn;
  for (const Bytes& packet : packets) REQUIRE(turn.add(packet));
  return {turn.bytes().begin(), turn.bytes().end()};
}

}  // namespace

TEST_CASE("the packets of a turn come one by one, those of the next only after a wait") {
  const Line line;
  line.end->push(orientation_of({{1, 2, 3}, {4}}));
  line.end->push(orientation_of({}));
  line.end->push(orientation_of({{5, 6}}));
  CHECK(line.port->wait(0));
  CHECK(line.take() == Bytes{1, 2, 3});
  CHECK(line.take() == Bytes{4});
  CHECK(line.take().empty());
  CHECK(line.take().empty());  // however long the next turn has been there
  CHECK(line.port->wait(0));
  CHECK(line.take().empty());  // nothing came in this tick
  CHECK(line.port->wait(0));
  CHECK(line.take() == Bytes{5, 6});
  CHECK_FALSE(line.port->wait(0));
}

TEST_CASE("what comes without a turn passes as it is") {
  const Line line;
  line.end->push(Bytes{'k', 'e', 'r', 'f'});
  line.end->push(Bytes(64, 7));
  CHECK(line.take() == Bytes{'k', 'e', 'r', 'f'});
  CHECK(line.take() == Bytes(64, 7));
}

TEST_CASE("a broken turn gives what is whole of it and reads nothing beyond") {
  const Line line;
  Bytes cut = orientation_of({{1, 2}, {3, 4, 5}});
  cut.pop_back();
  line.end->push(cut);
  CHECK(line.port->wait(0));
  CHECK(line.take() == Bytes{1, 2});
  CHECK(line.take().empty());
  Bytes bare(Turn::kMagic.begin(), Turn::kMagic.end());
  bare.push_back(0);
  line.end->push(bare);
  CHECK(line.port->wait(0));
  CHECK(line.take().empty());
}

TEST_CASE("a turn takes what fits and refuses the rest whole") {
  Turn turn;
  CHECK_FALSE(turn.add(Bytes{}));
  CHECK_FALSE(turn.add(Bytes(256, 1)));
  int added = 0;
  while (turn.add(Bytes(64, 1))) ++added;
  CHECK(added == 15);
  CHECK(turn.bytes().size() <= Turn::kMostBytes);
  CHECK(turn.add(Bytes(8, 2)));  // there is still room for a shorter one
}
