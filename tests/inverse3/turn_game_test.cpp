// SPDX-License-Identifier: Apache-2.0
// The game of turns on one connection, in the time of the test.
#include "arm/inverse3/turn_game.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <doctest/doctest.h>

namespace kerf::turn_game_test {
namespace {

using namespace kerf::inverse3;

constexpr std::int64_t kMs = 1'000'000;

std::string state(const std::string& mode = "force", const std::string& x = "0.01") {
  return R"({"inverse3":[{"device_id":"A","state":{"cursor_position":{"x":)" + x +
         R"(,"y":-0.1,"z":0.2},"current_cursor_force":{"x":0,"y":0,"z":0},"control_mode":")" +
         mode +
         R"("},"status":{"calibrated":true,"power_supply":true,"ready":true}}],)"
         R"("wireless_verse_grip":[{"device_id":"G","state":{"buttons":{"c":true}},)"
         R"("status":{"connected":true,"awake":true}}]})";
}

/// A connection in the time of the test.
struct Bench {
  explicit Bench(bool is_again = false, const std::string& mode = "idle") {
    ServiceState first;
    REQUIRE(parse_state(state(mode), first));
    turns.emplace(Wanted{.device_id = ShortText("A"), .is_again = is_again}, ForceKey::vector,
                  first, now_ns);
  }
  std::string next() {
    MessageBuffer buffer;
    return std::string(turns->next(command, now_ns, now_ns, now_ns, buffer));
  }
  TurnGame::Reply reply(const std::string& text) {
    return turns->take(text, ++number, now_ns, now_ns, report);
  }
  /// Until the device may push.
  void arm() {
    for (int turn = 0; turn < 200 && turns->session().bar() != Bar::none; ++turn, now_ns += kMs) {
      static_cast<void>(next());
      CHECK(reply(state()) == TurnGame::Reply::read);
    }
    REQUIRE(turns->session().bar() == Bar::none);
  }

  std::int64_t now_ns = 1000 * kMs;
  std::optional<TurnGame> turns;
  CartesianCommand command{.force_mn = {1000, 0, 0}, .force_on = true};
  std::optional<CartesianReport> report;
  std::uint32_t number = 0;
};

bool pushes(const std::string& message) {
  return message.find("\"x\":1.0000") != std::string::npos;
}

}  // namespace

TEST_CASE(
    "turns: the third unreadable reply in a row ends a connection, and a good one between does "
    "not") {
  for (const char* const bad : {"", "{", "null", "[]", "{}", R"({"inverse3":null})", "NaN"}) {
    CAPTURE(bad);
    Bench bench;
    bench.arm();
    for (int round = 0; round < 3; ++round) {
      for (int i = 0; i < 2; ++i, bench.now_ns += kMs) {
        CHECK(pushes(bench.next()));
        // A list without the device is read, and bars it.
        if (std::string(bad) == "{}") continue;
        CHECK(bench.reply(bad) == TurnGame::Reply::unread);
      }
      static_cast<void>(bench.next());
      CHECK(bench.reply(state()) == TurnGame::Reply::read);
    }
    if (std::string(bad) == "{}") continue;
    for (int i = 0; i < 3; ++i, bench.now_ns += kMs) {
      static_cast<void>(bench.next());
      CHECK(bench.reply(bad) == (i < 2 ? TurnGame::Reply::unread : TurnGame::Reply::lost));
    }
    CHECK(
        bench.turns->why_lost().starts_with("3 replies of the service in a row cannot be read: "));
  }
  for (const char* const x : {"1e300", "null", "\"here\"", "280", "-1e9"}) {
    CAPTURE(x);
    Bench bench;
    bench.arm();
    for (int i = 0; i < 3; ++i, bench.now_ns += kMs) {
      static_cast<void>(bench.next());
      CHECK(bench.reply(state("force", x)) ==
            (i < 2 ? TurnGame::Reply::unread : TurnGame::Reply::lost));
    }
  }
}

TEST_CASE("turns: an unreadable reply and then slow ones end the connection within 20 ms") {
  Bench slow;
  slow.arm();
  static_cast<void>(slow.next());
  CHECK(slow.reply("{") == TurnGame::Reply::unread);
  const std::int64_t bad_ns = slow.now_ns;
  static_cast<void>(slow.next());
  CHECK(slow.turns->look_ns() == bad_ns + TurnGame::kLateNs);
  slow.now_ns = bad_ns + TurnGame::kLateNs;
  CHECK(slow.turns->look(slow.now_ns, slow.now_ns) == TurnGame::Wait::late);
  CHECK(slow.turns->look_ns() == bad_ns + TurnGame::kUnreadNs);
  slow.now_ns = bad_ns + TurnGame::kUnreadNs - 1;
  CHECK(slow.turns->look(slow.now_ns, slow.now_ns) == TurnGame::Wait::goes_on);
  slow.now_ns = bad_ns + TurnGame::kUnreadNs;
  CHECK(slow.turns->look(slow.now_ns, slow.now_ns) == TurnGame::Wait::lost);
  static_assert(TurnGame::kUnreadNs < TurnGame::kTakeBackNs);

  Bench second;
  second.arm();
  static_cast<void>(second.next());
  CHECK(second.reply("{") == TurnGame::Reply::unread);
  second.now_ns += 8 * kMs;
  static_cast<void>(second.next());
  second.now_ns += 8 * kMs;
  CHECK(second.reply("{") == TurnGame::Reply::lost);
}

TEST_CASE(
    "turns: a silent service is late, stalled and lost, and what follows a stall has no force") {
  Bench bench;
  bench.arm();
  CHECK(pushes(bench.next()));
  const std::int64_t sent_ns = bench.now_ns;
  const auto look = [&](std::int64_t ms) {
    return bench.turns->look(sent_ns + ms * kMs, sent_ns + ms * kMs);
  };
  CHECK(look(4) == TurnGame::Wait::goes_on);
  CHECK(look(5) == TurnGame::Wait::late);
  CHECK(look(19) == TurnGame::Wait::goes_on);
  CHECK(look(20) == TurnGame::Wait::stalled);
  CHECK(look(99) == TurnGame::Wait::goes_on);
  CHECK(look(100) == TurnGame::Wait::lost);
  CHECK(bench.turns->why_lost().starts_with("the service has not replied for 100 ms; "));
  bench.now_ns = sent_ns + 50 * kMs;
  CHECK(bench.reply(state()) == TurnGame::Reply::read);
  CHECK_FALSE(pushes(bench.next()));
}

TEST_CASE("turns: the last word is zero force") {
  MessageBuffer buffer;
  CHECK(last_word(ShortText("A"), ForceKey::values, buffer) ==
        R"({"inverse3":[{"device_id":"A","commands":{"set_cursor_force":{"values":)"
        R"({"x":0.0000,"y":0.0000,"z":0.0000}}}}]})");
}

TEST_CASE(
    "turns: after a lost connection the old force is taken back, then the device has to fall "
    "idle") {
  Bench bench(true, "force");
  const std::string first = bench.next();
  CHECK(first.find("set_cursor_force") != std::string::npos);
  CHECK_FALSE(pushes(first));
  CHECK(bench.reply(state("force")) == TurnGame::Reply::read);
  CHECK(bench.turns->session().bar() == Bar::driven);
  for (int i = 0; i < 3; ++i) {
    CHECK(bench.next().find("probe_position") != std::string::npos);
    CHECK(bench.reply(state("force")) == TurnGame::Reply::read);
    CHECK_FALSE(bench.report->homed);
  }
  CHECK(bench.next().find("probe_position") != std::string::npos);
  CHECK(bench.reply(state("idle")) == TurnGame::Reply::read);
  CHECK(bench.next().find("set_cursor_force") != std::string::npos);
  bench.arm();
  CHECK(pushes(bench.next()));
}

}  // namespace kerf::turn_game_test
