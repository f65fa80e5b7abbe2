// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include "hil/device/emulator.hpp"
#include "hil/front/serving.hpp"
#include "shared/wire/omni.hpp"

namespace {

using kerf::HandshakeLink;
using kerf::LinkHello;
using kerf::Personality;
using Sent = kerf::PacketLink::Sent;
using Bytes = std::vector<std::uint8_t>;

constexpr LinkHello kOwn{Personality::omni, true, 1000};

/// A client in memory; nobody waits for it.
class FakeClient final : public kerf::PacketLink {
 public:
  FakeClient() : PacketLink(open("/dev/null", O_RDWR | O_CLOEXEC)) {}
  FakeClient(const FakeClient&) = delete;
  FakeClient& operator=(const FakeClient&) = delete;
  ~FakeClient() override { close(fd_); }
  std::span<const std::uint8_t> take(std::span<std::uint8_t> buffer) noexcept override {
    if (said.empty()) return {};
    const Bytes packet = said.front();
    said.pop_front();
    std::copy(packet.begin(), packet.end(), buffer.begin());
    return buffer.first(packet.size());
  }
  Sent send(std::span<const std::uint8_t> packet) noexcept override {
    heard.emplace_back(packet.begin(), packet.end());
    return Sent::yes;
  }
  void say(std::span<const std::uint8_t> packet) {
    said.emplace_back(packet.begin(), packet.end());
  }

  std::deque<Bytes> said;
  std::vector<Bytes> heard;
};

struct Meeting {
  FakeClient client;
  HandshakeLink link{client, kOwn};
  std::array<std::uint8_t, 65> buffer{};
};

}  // namespace

TEST_CASE("a hello is answered, the device's last packet follows, and each one again") {
  Meeting m;
  const Bytes first{1, 2, 3};
  const Bytes last{4, 5};
  CHECK(m.link.send(first) == Sent::yes);
  CHECK(m.link.send(last) == Sent::yes);
  m.client.say(encode(kOwn));
  m.client.say(encode(kOwn));  // its answer was lost
  CHECK(m.link.take(m.buffer).empty());
  REQUIRE(m.client.heard.size() == 4);
  CHECK(kerf::decode_hello(m.client.heard[2]) == kOwn);
  CHECK(m.client.heard[3] == last);
  CHECK(m.link.take(m.buffer).empty());
  CHECK(m.client.heard.size() == 6);
  CHECK_FALSE(m.link.closed());
  CHECK(m.link.refusal().empty());
}

TEST_CASE("one that does not fit hears what is here, and the link closes") {
  Meeting m;
  CHECK(m.link.send(Bytes{1}) == Sent::yes);
  m.client.say(encode(LinkHello{Personality::omni, false, 1000}));
  CHECK(m.link.take(m.buffer).empty());
  CHECK(m.link.closed());
  CHECK(m.link.refusal().find("the emulator runs in lock-step") == 0);
  CHECK(kerf::decode_hello(m.client.heard.back()) == kOwn);
}

TEST_CASE("a client without a hello is served as it is, and a late hello is only a packet") {
  Meeting m;
  const auto command = encode(kerf::OmniCommand{});
  m.client.say(command);
  m.client.say(encode(LinkHello{Personality::falcon, false, 8000}));
  CHECK(m.link.take(m.buffer).size() == command.size());
  CHECK(m.link.take(m.buffer).size() == kerf::kHelloBytes);
  CHECK(m.client.heard.empty());
  CHECK_FALSE(m.link.closed());
}

TEST_CASE("in lock-step a session after a hello has the bytes of one without") {
  std::vector<Bytes> heard[2];
  for (const bool greets : {false, true}) {
    kerf::Emulator emulator(kerf::OmniParams{}, std::nullopt);
    Meeting m;
    if (greets) m.client.say(encode(kOwn));
    for (int tick = 0; tick < 50; ++tick) m.client.say(encode(kerf::OmniCommand{}));
    const std::atomic<bool> stop{false};
    kerf::FrontStats stats;
    kerf::serve_lockstep(m.link, emulator, {.tick_cycles = 8}, {8 * 50, stop}, stats);
    CHECK(stats.cycles == 8 * 50);
    heard[greets ? 1 : 0] = m.client.heard;
  }
  const auto answer = std::find_if(heard[1].begin(), heard[1].end(), [](const Bytes& packet) {
    return kerf::decode_hello(packet).has_value();
  });
  REQUIRE(answer != heard[1].end());
  CHECK(std::vector<Bytes>(answer + 1, heard[1].end()) == heard[0]);
  CHECK(heard[0].size() == 51);
}
