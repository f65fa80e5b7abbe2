// SPDX-License-Identifier: Apache-2.0
// The far end of a bridge, fed by hand: what local readers find, and what makes it start afresh.
#include "bridge/stream/mirror.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>

#include <doctest/doctest.h>

#include "shared/segment/connection.hpp"
#include "tests/bridge/sender.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::mirror_test {

using namespace kerf::bridge;
using kerf::bridge::test::Message;
using kerf::bridge::test::Sender;
using kerf::test::RuntimeFolder;

namespace {

constexpr std::uint64_t kEnough = 1 << 30;
constexpr std::int64_t kHourNs = 3'600'000'000'000;

Reply refuse(const SegmentCommand&) {
  return {};
}

struct FarEnd {
  RuntimeFolder folder;
  Mirror mirror{"far", kEnough, refuse};
  std::int64_t now_ns = 50 * kHourNs;

  void greet(Sender& sender) { mirror.hello(sender.greeting(), now_ns, 0); }
  void apply(const Message& message) { mirror.frame(message, now_ns, 0); }
  void apply(const std::vector<Message>& pass) {
    for (const Message& message : pass) apply(message);
  }
};

/// What a local reader finds under the name; nothing where there is none.
std::optional<VolumeSnapshot> seen(const char* name = "far") {
  try {
    const SegmentConnection connection = connect_segment(name);
    VolumeSnapshot out;
    connection.reader().update(0, out);
    return out;
  } catch (const SegmentAbsent&) {
    return std::nullopt;
  }
}

/// True where every voxel has the content of a brick of `tick`.
bool all_of_tick(const VolumeSnapshot& snapshot, std::uint64_t tick) {
  const auto byte = static_cast<std::uint8_t>(stable_version(tick));
  const auto density = static_cast<Density>(byte << 8 | byte);
  return std::all_of(snapshot.density.begin(), snapshot.density.end(),
                     [density](Density d) { return d == density; });
}

}  // namespace

TEST_CASE("a run appears under its name with its first whole pass, not before") {
  for (const bool packed : {false, true}) {
    FarEnd far;
    Sender sender(7, 33, 1500, true);
    sender.packed = packed;
    far.greet(sender);
    const auto pass = sender.whole_pass(3);
    REQUIRE(pass.size() > 2);
    for (const Message& message : pass) {
      CHECK(!seen());
      CHECK(!far.mirror.joined());
      const AckMessage ack = far.mirror.frame(message, far.now_ns, 0);
      CHECK(ack.magic == kAckMagic);
      CHECK(ack.session == 7);
    }
    CHECK(far.mirror.joined());
    REQUIRE(seen());
    CHECK(seen()->consistent);
    CHECK(seen()->tick == 3);
    CHECK(all_of_tick(*seen(), 3));
    const SegmentConnection connection = connect_segment("far");
    CHECK(connection.reader().info().scene_json == std::string(1500, '\x02'));
    CHECK(connection.reader().info().session_id == 7);
    const auto labels = connection.reader().labels(0);
    CHECK(std::all_of(labels.begin(), labels.end(), [](Label label) { return label == 2; }));
  }
}

TEST_CASE("a later pass is seen whole or not at all") {
  FarEnd far;
  Sender sender(7);
  far.greet(sender);
  far.apply(sender.whole_pass(3));
  far.apply(sender.frame_of({{2, 20}, {3, 20}}, 9, 0));
  CHECK(seen()->consistent);
  CHECK(seen()->tick == 3);
  CHECK(all_of_tick(*seen(), 3));
  far.apply(sender.frame_of({{4, 20}}, 9, kLastOfPass));
  CHECK(seen()->tick == 9);
  CHECK(seen()->versions == std::vector<std::uint64_t>{20, 20, 20, 8, 8, 8, 8, 8});
  far.apply(sender.frame_of({}, 11, kLastOfPass));  // sign of life
  CHECK(seen()->tick == 11);
}

TEST_CASE("what does not fit is refused, and the picture stays until a whole pass came anew") {
  const auto refused = [](auto spoil) {
    FarEnd far;
    Sender sender(7);
    far.greet(sender);
    far.apply(sender.whole_pass(3));
    far.apply(sender.frame_of({{2, 20}}, 9, 0));
    spoil(far, sender);
    CHECK(seen()->tick == 3);
    CHECK(all_of_tick(*seen(), 3));
    far.greet(sender);
    CHECK(!far.mirror.joined());
    auto pass = sender.whole_pass(9);
    const Message last = pass.back();
    pass.pop_back();
    far.apply(pass);
    CHECK(all_of_tick(*seen(), 3));
    far.apply(last);
    CHECK(far.mirror.joined());
    CHECK(seen()->tick == 9);
    CHECK(all_of_tick(*seen(), 9));
  };
  refused([](FarEnd& far, Sender& sender) {
    sender.set_hash += 1;
    CHECK_THROWS_AS(far.apply(sender.frame_of({{3, 20}}, 9, kLastOfPass)), StreamOutOfSync);
  });
  refused([](FarEnd& far, Sender& sender) {
    static_cast<void>(sender.frame_of({{3, 20}}, 9, 0));  // lost
    CHECK_THROWS_AS(far.apply(sender.frame_of({{4, 20}}, 9, kLastOfPass)), StreamOutOfSync);
  });
  refused([](FarEnd& far, Sender& sender) {
    CHECK_THROWS_AS(far.apply(sender.frame_of({{2, 20}}, 9, 0)), StreamOutOfSync);  // again
  });
  refused([](FarEnd& far, Sender&) {
    Sender foreign(8);
    CHECK_THROWS_AS(far.apply(foreign.frame_of({{3, 20}}, 9, kLastOfPass)), WireError);
  });
  refused([](FarEnd& far, Sender& sender) {
    for (std::uint64_t version = 22; version < 36; version += 2) {
      far.apply(sender.frame_of({{2, version}}, 9, 0));
    }
    CHECK_THROWS_AS(
        [&] {
          for (std::uint64_t version = 36; version < 100; version += 2) {
            far.apply(sender.frame_of({{2, version}}, 9, 0));
          }
        }(),
        StreamOutOfSync);  // a pass without end would fill the memory
  });
}

TEST_CASE("a first pass with a hole is no picture, though its hash is right") {
  FarEnd far;
  Sender sender(7);
  far.greet(sender);
  CHECK_THROWS_AS(far.apply(sender.frame_of({}, 3, kLastOfPass)), StreamOutOfSync);
  CHECK(!seen());
  CHECK_THROWS_AS(Mirror("else", kEnough, refuse).frame(sender.frame_of({}, 3, 0), 0, 0),
                  StreamOutOfSync);
  CHECK_THROWS_AS(Mirror("else", kEnough, refuse).records(sender.record(0, 0)), StreamOutOfSync);
}

TEST_CASE("a join that is cut off goes on where nothing has to come twice, and still checks all") {
  FarEnd far;
  Sender sender(7, 64);
  far.greet(sender);
  auto pass = sender.whole_pass(3);
  pass.resize(pass.size() / 2);
  far.apply(pass);
  far.greet(sender);
  far.apply(sender.whole_pass(4));
  CHECK(seen()->tick == 4);
  CHECK(all_of_tick(*seen(), 4));
}

TEST_CASE("a new run is a new segment, and the old picture stays until it is whole") {
  FarEnd far;
  Sender first(7), second(8, 24);
  far.greet(first);
  far.apply(first.whole_pass(100));
  const SegmentConnection reader = connect_segment("far");
  far.greet(second);
  auto pass = second.whole_pass(1);
  const Message last = pass.back();
  pass.pop_back();
  far.apply(pass);
  CHECK(reader.alive());
  CHECK(seen()->session_id == 7);
  far.apply(last);
  CHECK(!reader.alive());
  CHECK(seen()->session_id == 8);
  CHECK(seen()->tick == 1);
  CHECK(all_of_tick(*seen(), 1));
}

TEST_CASE("the end of a run takes its name away, and readers keep what they have") {
  FarEnd far;
  Sender sender(7);
  far.greet(sender);
  far.apply(sender.whole_pass(3));
  SegmentConnection connection = connect_segment("far");
  sender.next.lifecycle = static_cast<std::uint32_t>(Lifecycle::clean_end);
  far.apply(sender.frame_of({}, 5, kLastOfPass | kRunEnded));
  CHECK(far.mirror.ended());
  CHECK(!connection.alive());
  CHECK(connection.reader().lifecycle() == Lifecycle::clean_end);
  CHECK(!seen());
  Sender again(9);
  far.greet(again);
  far.apply(again.whole_pass(1));
  CHECK(!far.mirror.ended());
  CHECK(seen()->session_id == 9);
}

TEST_CASE("clocks that differ by hours: local readers see local times") {
  for (const std::int64_t apart : {-30 * kHourNs, std::int64_t{0}, 30 * kHourNs}) {
    FarEnd far;
    Sender sender(7);
    const auto theirs = [&] { return far.now_ns + apart; };
    sender.hello.server_ns = theirs();
    sender.hello.start_ns = static_cast<std::uint64_t>(theirs() - 5'000'000'000);
    far.greet(sender);
    sender.next.sent_ns = theirs();
    sender.next.taken_ns = theirs() - 8'000'000;
    sender.next.heartbeat_ns = theirs() - 9'000'000;
    far.mirror.records(sender.record(41, static_cast<std::uint64_t>(theirs() - 10'000'000)));
    far.apply(sender.whole_pass(3));
    CHECK(far.mirror.taken_ns() == far.now_ns - 8'000'000);
    const SegmentConnection connection = connect_segment("far");
    CHECK(connection.reader().heartbeat_ns() == static_cast<std::uint64_t>(far.now_ns - 9'000'000));
    CHECK(connection.reader().info().start_ns ==
          static_cast<std::uint64_t>(far.now_ns - 5'000'000'000));
    REQUIRE(connection.reader().latest());  // so its checksum is right
    CHECK(connection.reader().latest()->tick == 42);
    CHECK(connection.reader().latest()->start_ns ==
          static_cast<std::uint64_t>(far.now_ns - 10'000'000));
  }
}

TEST_CASE("a run that is older than this machine is no run in lock-step") {
  FarEnd far;
  Sender sender(7);
  sender.hello.server_ns = far.now_ns + 30 * kHourNs;
  sender.hello.start_ns = 1;
  far.greet(sender);
  far.apply(sender.whole_pass(3));
  CHECK(connect_segment("far").reader().info().start_ns == 1);
}

TEST_CASE("a run in lock-step has no clock: its ticks keep their times on the far side") {
  FarEnd far;
  Sender sender(7);
  sender.hello.server_ns = far.now_ns + 30 * kHourNs;
  sender.hello.start_ns = 0;
  far.greet(sender);
  sender.next.heartbeat_ns = far.now_ns + 30 * kHourNs - 9'000'000;
  far.mirror.records(sender.record(41, 42'000'000));
  far.apply(sender.whole_pass(3));
  const SegmentConnection connection = connect_segment("far");
  CHECK(connection.reader().info().start_ns == 0);
  REQUIRE(connection.reader().latest());
  CHECK(connection.reader().latest()->start_ns == 42'000'000);
  CHECK(connection.reader().heartbeat_ns() == static_cast<std::uint64_t>(far.now_ns - 9'000'000));
}

TEST_CASE("the clock's offset is that of the fastest message, and follows a drift slowly") {
  ClockOffset clock;
  const std::int64_t start = 10 * kHourNs, way = 20'000'000;
  std::int64_t now = start;
  const auto come = [&](std::int64_t delay) { clock.sample(now - 7 * kHourNs, now + delay, 0); };
  come(way + 30'000'000);
  come(way);
  for (int i = 0; i < 600; ++i, now += 16'000'000) come(way + 100'000'000);  // a queue, 9.6 s
  // Within 1 ms: 100 ppm of 9.6 s.
  CHECK(clock.local(start) - (start + 7 * kHourNs + way) >= 0);
  CHECK(clock.local(start) - (start + 7 * kHourNs + way) <= 1'000'000);
  come(way);
  CHECK(clock.local(start) == start + 7 * kHourNs + way);
  clock.sample(now - 7 * kHourNs, now + way, 2 * way);
  CHECK(clock.local(start) == start + 7 * kHourNs);
  CHECK(clock.local(-9 * kHourNs) == 0);  // before our start
}

TEST_CASE("a clock that jumps to the ends of its range wraps nothing") {
  constexpr std::int64_t kLow = INT64_MIN, kHigh = INT64_MAX;
  for (const std::int64_t theirs : {kLow, std::int64_t{0}, kHigh}) {
    for (const std::int64_t ours : {std::int64_t{0}, kHigh}) {
      ClockOffset clock;
      clock.sample(theirs, ours, kHigh);
      clock.sample(kHigh, ours, 0);
      clock.sample(kLow, 0, 1);
      CHECK(clock.local(kHigh) >= 0);
      CHECK(clock.local(kLow) == 0);
      CHECK(clock.local(std::uint64_t{UINT64_MAX}) <= UINT64_MAX / 2);
    }
  }
}

TEST_CASE("a name that is taken, another layout and a segment too large are told at once") {
  FarEnd far;
  Sender sender(7);
  far.greet(sender);
  far.apply(sender.whole_pass(3));
  CHECK_THROWS_AS(Mirror("far", kEnough, refuse), SegmentError);
  CHECK_THROWS_AS(Mirror("../far", kEnough, refuse), SegmentError);
  Sender other(8);
  other.hello.abi_hash ^= 1;
  CHECK_THROWS_AS(far.greet(other), SegmentError);
  Sender large(8, 1000);
  CHECK_THROWS_AS(far.greet(large), SegmentError);
  CHECK(seen()->tick == 3);
}

TEST_CASE("a local reader's command gets the far side's answer, or is told that there is none") {
  RemoteCommand desk;
  std::atomic<bool> done{false};
  std::atomic<std::uint32_t> kind{0}, arm{0};
  std::thread far([&] {
    for (; !done; std::this_thread::yield()) {
      const auto sent = desk.take();
      if (!sent) continue;
      kind = sent->kind;
      arm = sent->arm;
      if (sent->argument == 1) desk.answer({kReplyMagic, sent->sequence - 1, 0, 4});  // late
      if (sent->argument <= 1) desk.answer({kReplyMagic, sent->sequence, 0, 9});
      if (sent->argument == 2) desk.answer({kReplyMagic, sent->sequence, 77, 0});
      if (sent->argument == 3) desk.set_link(RemoteCommand::Link::down);
    }
  });
  CHECK(desk.request({}).status == ReplyStatus::busy);  // no connection: try again
  desk.set_link(RemoteCommand::Link::read_only);
  CHECK(desk.request({}).status == ReplyStatus::refused);
  desk.set_link(RemoteCommand::Link::open);
  for (const std::uint32_t argument : {0U, 1U}) {
    const Reply reply = desk.request({.kind = CommandKind::select_tool, .argument = argument});
    CHECK(reply.status == ReplyStatus::accepted);
    CHECK(reply.index == 9);
    CHECK(kind == static_cast<std::uint32_t>(CommandKind::select_tool));
  }
  CHECK(desk.request({.kind = CommandKind::select_tool, .arm = 1}).status == ReplyStatus::accepted);
  CHECK(arm == 1);
  // What the message has no room for is not cut to what it has.
  CHECK(desk.request({.kind = CommandKind::select_tool, .arm = 0x10001}).status ==
        ReplyStatus::refused);
  CHECK(desk.request({.kind = static_cast<CommandKind>(0x10001)}).status == ReplyStatus::refused);
  CHECK(desk.request({.argument = 2}).status == ReplyStatus::refused);
  CHECK(desk.request({.argument = 3}).status == ReplyStatus::busy);  // lost while it waited
  CHECK(!desk.take());
  done = true;
  far.join();
}

}  // namespace kerf::mirror_test
