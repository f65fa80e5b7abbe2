// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/wire/compression.hpp"
#include "bridge/wire/messages.hpp"
#include "bridge/wire/parse.hpp"
#include "tests/bridge/sender.hpp"

namespace kerf::wire_test {

using namespace kerf::bridge;

namespace {

using bridge::test::append;
using bridge::test::Message;

/// 20 x 9 x 5 voxels: 3 x 2 x 1 bricks.
VolumeDescriptor small_volume(std::uint64_t labels) {
  VolumeDescriptor volume{};
  volume.nx = 20, volume.ny = 9, volume.nz = 5;
  volume.log2_brick = 3, volume.bits_per_voxel = 16;
  volume.bricks_x = 3, volume.bricks_y = 2, volume.bricks_z = 1, volume.brick_count = 6;
  for (double& mm : volume.spacing_mm) mm = 0.1;
  volume.orientation[3] = 1;
  volume.off_labels = labels;
  return volume;
}

HelloMessage small_hello() {
  HelloMessage head{};
  head.magic = kHelloMagic, head.protocol = 1, head.session = 77, head.tick_ns = 1'000'000;
  head.volume_count = 2, head.scene_bytes = 1025;
  return head;
}

Message hello_message(const HelloMessage& head, const VolumeDescriptor& first) {
  Message message;
  append(message, head);
  append(message, first);
  append(message, small_volume(0));
  return message;
}

/// Text 0..1, density 2..7 and 8..13, labels 14..19.
ParsedHello small_run() {
  return parse_hello(hello_message(small_hello(), small_volume(1)));
}

struct TestFrame {
  FrameHead head{};
  std::vector<std::uint64_t> versions{2, 2, 2};
  std::vector<std::uint32_t> ids{1, 9, 15};
  Message payload = Message(1024 + 1024 + 512, std::byte{7});

  TestFrame() {
    head.magic = kFrameMagic, head.session = 77, head.frame = 1;
    head.blocks = 3, head.raw_bytes = head.payload_bytes = 2560;
  }
  [[nodiscard]] Message message() const {
    Message out;
    append(out, head);
    for (const std::uint64_t version : versions) append(out, version);
    for (const std::uint32_t id : ids) append(out, id);
    out.insert(out.end(), payload.begin(), payload.end());
    return out;
  }
  void make_packed() {
    const Message raw = payload;
    payload.resize(packed_bound(raw.size()));
    payload.resize(pack(raw, payload));
    head.flags |= kPacked;
    head.payload_bytes = static_cast<std::uint32_t>(payload.size());
  }
};

}  // namespace

TEST_CASE("magics read as text in a dump of the bytes") {
  CHECK(std::memcmp(&kHelloMagic, "KBH1", 4) == 0);
  CHECK(std::memcmp(&kCommandMagic, "KBC1", 4) == 0);
}

TEST_CASE("blocks are numbered text, density, labels") {
  const BlockPlan plan(1025, std::vector{small_volume(1), small_volume(0)});
  REQUIRE(plan.count() == 20);
  CHECK(plan.plane_of(0).kind == BlockKind::text);
  CHECK(plan.plane_of(1).kind == BlockKind::text);
  CHECK(plan.plane_of(2).kind == BlockKind::density);
  CHECK(plan.plane_of(7).volume == 0);
  CHECK(plan.plane_of(8).volume == 1);
  CHECK(plan.plane_of(13).kind == BlockKind::density);
  CHECK(plan.plane_of(14).kind == BlockKind::labels);
  CHECK(plan.plane_of(19).block_bytes() == 512);
  CHECK(BlockPlan(0, std::vector{small_volume(0)}).plane_of(0).kind == BlockKind::density);
}

TEST_CASE("a frame comes out as it went in, packed or not") {
  FrameParser parser(small_run());
  for (const bool packed : {false, true}) {
    CAPTURE(packed);
    TestFrame frame;
    if (packed) frame.make_packed();
    const Message message = frame.message();
    CHECK(parser.parse(message).frame == 1);
    REQUIRE(parser.blocks().size() == 3);
    CHECK(parser.blocks()[2].id == 15);
    CHECK(parser.blocks()[2].bytes.size() == 512);
    CHECK(parser.blocks()[0].bytes[1023] == std::byte{7});
  }
}

TEST_CASE("a frame that does not hold is refused and leaves nothing") {
  FrameParser parser(small_run());
  const auto refused = [&parser](auto&& spoil) {
    TestFrame frame;
    spoil(frame);
    CHECK_THROWS_AS(parser.parse(frame.message()), WireError);
    CHECK(parser.blocks().empty());
  };
  refused([](TestFrame& f) { f.head.session = 78; });
  refused([](TestFrame& f) { f.head.magic = kHelloMagic; });
  refused([](TestFrame& f) { f.ids[0] = 20; });
  refused([](TestFrame& f) { f.ids[0] = 0xffffffff; });
  refused([](TestFrame& f) { f.versions[1] = 0; });
  refused([](TestFrame& f) { f.versions[1] = 3; });
  refused([](TestFrame& f) { f.versions[0] = 4; });  // text has one version
  refused([](TestFrame& f) { f.head.raw_bytes = 2559; });
  refused([](TestFrame& f) { f.head.raw_bytes = 0xffffffff; });
  refused([](TestFrame& f) { f.head.payload_bytes = 0xffffffff; });
  refused([](TestFrame& f) { f.head.blocks = 2; });
  refused([](TestFrame& f) { f.head.blocks = 0xffffffff; });
  refused([](TestFrame& f) { f.payload.pop_back(); });
  refused([](TestFrame& f) { f.payload.resize(30'000); });
  refused([](TestFrame& f) { f.ids[2] = 1; });  // now 3072 bytes
  refused([](TestFrame& f) {
    f.make_packed();
    f.head.raw_bytes = 2561;
  });
  refused([](TestFrame& f) {
    f.make_packed();
    f.payload[0] ^= std::byte{0xf0};
  });
  for (std::size_t bytes = 0; bytes < sizeof(FrameHead) + 36; ++bytes) {
    Message cut = TestFrame().message();
    cut.resize(bytes);
    CHECK_THROWS_AS(parser.parse(cut), WireError);
  }
}

TEST_CASE("a greeting that does not hold is refused") {
  const auto refused = [](auto&& spoil) {
    HelloMessage head = small_hello();
    VolumeDescriptor volume = small_volume(1);
    spoil(head, volume);
    CHECK_THROWS_AS(static_cast<void>(parse_hello(hello_message(head, volume))), WireError);
  };
  refused([](HelloMessage& h, VolumeDescriptor&) { h.protocol = 2; });
  refused([](HelloMessage& h, VolumeDescriptor&) { h.volume_count = 0; });
  refused([](HelloMessage& h, VolumeDescriptor&) { h.volume_count = 3; });
  refused([](HelloMessage& h, VolumeDescriptor&) { h.volume_count = 0xffffffff; });
  refused([](HelloMessage& h, VolumeDescriptor&) { h.scene_bytes = 0xffffffff; });
  refused([](HelloMessage& h, VolumeDescriptor&) { h.tick_ns = 0; });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.nx = 0; });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.nx = 25; });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.brick_count = 7; });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.log2_brick = 4; });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.bits_per_voxel = 8; });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.spacing_mm[1] = -1; });
  refused([](HelloMessage&, VolumeDescriptor& v) {
    v.origin_mm[1] = std::numeric_limits<double>::infinity();
  });
  refused([](HelloMessage&, VolumeDescriptor& v) { v.off_bricks = 4096; });
}

TEST_CASE("records are refused where count, size or index do not fit") {
  std::array<std::byte, kMaxRawBytes> scratch;
  RecordsHead head{};
  head.magic = kRecordsMagic, head.session = 77, head.ring = 1, head.count = 2, head.stride = 3;
  head.first = 100, head.raw_bytes = head.payload_bytes = 128;
  const auto parse = [&scratch](const RecordsHead& h) {
    Message message;
    append(message, h);
    message.resize(message.size() + 128);
    return parse_records(message, 77, scratch).bytes.size();
  };
  CHECK(parse(head) == 128);
  const auto refused = [&](auto&& spoil) {
    RecordsHead bad = head;
    spoil(bad);
    CHECK_THROWS_AS(static_cast<void>(parse(bad)), WireError);
  };
  refused([](RecordsHead& h) { h.ring = 2; });
  refused([](RecordsHead& h) { h.count = 3; });
  refused([](RecordsHead& h) { h.count = 0x04000002; });  // 64 times it wraps to 128
  refused([](RecordsHead& h) { h.ring = 3; });
  refused([](RecordsHead& h) { h.ring = static_cast<std::uint32_t>(Ring::pairs); });  // longer
  refused([](RecordsHead& h) { h.stride = 0; });
  refused([](RecordsHead& h) { h.first = UINT64_MAX; });
  refused([](RecordsHead& h) { h.flags = kPacked; });
  refused([](RecordsHead& h) { h.session = 1; });
}

TEST_CASE("a server takes acks and commands of the right size and nothing else") {
  Message message;
  append(message, AckMessage{kAckMagic, 0, 77, 5});
  auto up = parse_up(message);
  REQUIRE(up.has_value());
  CHECK(std::get<AckMessage>(*up).frame == 5);
  message.push_back(std::byte{});
  CHECK(!parse_up(message).has_value());
  CHECK(!parse_up({}).has_value());
  message.clear();
  append(message, CommandMessage{kCommandMagic, 2, 1, 1, 9});
  up = parse_up(message);
  REQUIRE(up.has_value());
  CHECK(std::get<CommandMessage>(*up).sequence == 9);
  CHECK(std::get<CommandMessage>(*up).arm == 1);
  // Of a viewer that knows no arms the kind has 32 bits.
  message.clear();
  for (const std::uint32_t word : {kCommandMagic, 1U, 2U, 9U}) append(message, word);
  up = parse_up(message);
  REQUIRE(up.has_value());
  CHECK(std::get<CommandMessage>(*up).kind == 1);
  CHECK(std::get<CommandMessage>(*up).arm == 0);
  CHECK(std::get<CommandMessage>(*up).argument == 2);
}

TEST_CASE("a view has 80 bytes in both directions") {
  Message message;
  append(message, view_message(Presenter::another, {{1, 2, 3}, {4, 5, 6}, {0, 1, 0}}));
  const auto up = parse_up(message);
  REQUIRE(up.has_value());
  CHECK(view_in(std::get<ViewMessage>(*up)).target_mm[2] == 6);
  CHECK(parse_view(message).presenter == 1);
  message.pop_back();
  CHECK(!parse_up(message).has_value());
  CHECK_THROWS_AS(static_cast<void>(parse_view(message)), WireError);
}

TEST_CASE("random bytes are refused, not obeyed") {
  FrameParser parser(small_run());
  std::array<std::byte, kMaxRawBytes> scratch;
  std::mt19937 random(1);
  for (int i = 0; i < 20'000; ++i) {
    TestFrame frame;
    if (i % 2 != 0) frame.make_packed();
    Message message = frame.message();
    for (int k = 0; k < 3; ++k) message[random() % message.size()] = std::byte(random());
    try {
      parser.parse(message);
    } catch (const WireError&) {
    }
    try {
      static_cast<void>(parse_records(message, 77, scratch));
    } catch (const WireError&) {
    }
    static_cast<void>(parse_up(message));
  }
}

TEST_CASE("the set hash does not depend on the order in which versions came") {
  const std::uint64_t ab = with_block(with_block(0, 1, 0, 2, 77), 2, 0, 4, 77);
  const std::uint64_t ba =
      with_block(with_block(with_block(0, 2, 0, 2, 77), 1, 0, 2, 77), 2, 2, 4, 77);
  CHECK(ab == ba);
  CHECK(ab != with_block(with_block(0, 1, 0, 2, 78), 2, 0, 4, 78));
}

}  // namespace kerf::wire_test
