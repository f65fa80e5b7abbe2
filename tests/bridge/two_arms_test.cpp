// SPDX-License-Identifier: Apache-2.0
// A run with two devices over the bridge: of each tick that arrives both records do, on every link.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/stream/mirror.hpp"
#include "bridge/stream/stream.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"
#include "tests/bridge/sender.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::two_arms_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

Reply refuse(const SegmentCommand&) {
  return {};
}

/// A controller's segment, the stream of one viewer, and that viewer's copy of it.
struct Line {
  explicit Line(std::size_t arms)
      : writer(SegmentWriter::create(spec(arms))), reader(SegmentReader::map(writer.fd())) {}

  [[nodiscard]] SegmentSpec spec(std::size_t arms) const {
    SegmentSpec out = spec_of(volume);
    out.arms = arms;
    return out;
  }
  void publish(int ticks) {
    for (; ticks > 0; --ticks) {
      cut_and_publish(writer, volume, ++tick, {{0, 0, 0}, {1, 1, 1}}, reader.info().arms);
    }
  }
  /// One slot whose messages all arrive.
  void slot(Mirror& mirror) {
    now_ns += kSlotNs;
    snapshot.update(now_ns, false);
    stream.note_changes();
    stream.slot(now_ns, false);
    for (std::vector<std::byte> message; stream.next(now_ns, message);) {
      CHECK(message.size() <= kMaxMessageBytes);
      switch (magic_of(message)) {
        case kHelloMagic:
          mirror.hello(message, now_ns + ahead_ns, 0);
          break;
        case kFrameMagic: {
          const AckMessage ack = mirror.frame(message, now_ns + ahead_ns, 0);
          CHECK(stream.acked(ack, now_ns));
          break;
        }
        default:
          mirror.records(message);
      }
    }
  }

  NoiseVolume volume{{24, 8, 8}};
  SegmentWriter writer;
  SegmentReader reader;
  RunSnapshot snapshot{reader};
  Stream stream{snapshot, 0};
  Tick tick = 0;
  std::int64_t now_ns = 1'000'000'000;
  std::int64_t ahead_ns = 0;  ///< of the far machine's clock
};

}  // namespace

TEST_CASE("the far segment has both arms: every tick of the near one, the same index for both") {
  const RuntimeFolder folder;
  Line line(2);
  line.ahead_ns = 7'000'000'000;
  Mirror mirror("far", 1 << 30, refuse);
  line.publish(3);
  line.slot(mirror);
  const std::uint64_t first_index = line.reader.state_head() - 1;
  for (int i = 0; i < 40; ++i) {
    line.publish(17);
    line.slot(mirror);
  }
  const SegmentConnection far = connect_segment("far");
  CHECK(far.reader().info().arms == 2);
  REQUIRE(far.reader().state_head() == line.reader.state_head());
  CHECK(far.reader().state_head(1) == line.reader.state_head());
  for (std::uint64_t i = first_index; i < line.reader.state_head(); ++i) {
    for (const std::size_t arm : {0U, 1U}) {
      CAPTURE(i);
      CAPTURE(arm);
      TickRecord near_record, far_record;
      REQUIRE(line.reader.state_at(i, near_record, arm) == ReadState::ok);
      REQUIRE(far.reader().state_at(i, far_record, arm) == ReadState::ok);
      CHECK(far_record.tick == near_record.tick);
      CHECK(far_record.start_ns ==
            near_record.start_ns + static_cast<std::uint64_t>(line.ahead_ns));
      CHECK(far_record.position_mm[0] == (arm == 0 ? 1 : -1) * static_cast<double>(i + 1));
    }
  }
  VolumeSnapshot snapshot;
  far.reader().update(0, snapshot);
  CHECK(snapshot.density == line.volume.density);
}

TEST_CASE("ticks that are left out are left out for both arms, and the newest always comes") {
  const RuntimeFolder folder;
  Line line(2);
  Mirror mirror("far", 1 << 30, refuse);
  line.publish(3);
  line.slot(mirror);
  line.publish(3500);  // more than the slots that the bridge may be late by
  line.slot(mirror);
  const SegmentConnection far = connect_segment("far");
  std::uint64_t both = 0;
  for (std::uint64_t i = 3; i < line.reader.state_head(); ++i) {
    TickRecord first, second;
    const ReadState state = far.reader().state_at(i, first);
    CHECK(far.reader().state_at(i, second, 1) == state);
    both += state == ReadState::ok ? 1 : 0;
  }
  CHECK(both > 100);
  CHECK(both < 200);
  REQUIRE(far.reader().latest());
  CHECK(far.reader().latest()->tick == line.tick);
  CHECK(far.reader().second_of(*far.reader().latest()));
}

TEST_CASE("the greeting says how many arms there are; one arm is sent as it always was") {
  for (const std::size_t arms : {1U, 2U}) {
    Line line(arms);
    line.publish(2);
    line.snapshot.update(5, false);
    line.stream.slot(5, false);
    std::vector<std::byte> message;
    REQUIRE(line.stream.next(5, message));
    CHECK(parse_hello(message).head.flags == (arms == 2 ? kTwoArms : 0));
    REQUIRE(line.stream.next(5, message));
    std::array<std::byte, kMaxRawBytes> scratch;
    const ParsedRecords records = parse_records(message, line.reader.info().session_id, scratch);
    CHECK(records.head.ring == (arms == 2 ? 2U : 0U));
    CHECK(records.bytes.size() == arms * sizeof(TickRecord));
  }
}

TEST_CASE("a greeting of the same session with another number of arms is another run") {
  const RuntimeFolder folder;
  Mirror mirror("far", 1 << 30, refuse);
  for (const std::size_t arms : {1U, 2U, 1U}) {
    CAPTURE(arms);
    bridge::test::Sender sender(7);
    sender.hello.flags = arms == 2 ? kTwoArms : 0;
    mirror.hello(sender.greeting(), 1, 0);
    for (const auto& message : sender.whole_pass(5)) mirror.frame(message, 2, 0);
    CHECK(connect_segment("far").reader().info().arms == arms);
  }
}

TEST_CASE("records of another number of arms than the greeting's are refused") {
  const RuntimeFolder folder;
  Mirror mirror("far", 1 << 30, refuse);
  bridge::test::Sender sender(7);
  sender.hello.flags = kTwoArms;
  mirror.hello(sender.greeting(), 1, 0);
  CHECK_THROWS_AS(mirror.records(sender.record(3, 0)), StreamOutOfSync);
  bridge::test::Sender single(8);
  mirror.hello(single.greeting(), 1, 0);
  CHECK_NOTHROW(mirror.records(single.record(3, 0)));
  bridge::test::Message pair = single.record(3, 0);
  RecordsHead head{};
  std::memcpy(&head, pair.data(), sizeof head);
  head.ring = static_cast<std::uint32_t>(Ring::pairs);
  head.raw_bytes = head.payload_bytes = 2 * sizeof(TickRecord);
  std::memcpy(pair.data(), &head, sizeof head);
  pair.resize(sizeof head + 2 * sizeof(TickRecord));
  CHECK_THROWS_AS(mirror.records(pair), StreamOutOfSync);
}

}  // namespace kerf::two_arms_test
