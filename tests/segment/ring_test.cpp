// SPDX-License-Identifier: Apache-2.0
#include <cstddef>

#include <doctest/doctest.h>

#include "shared/segment/reader.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::ring_test {

using namespace kerf::test;

TEST_CASE("tick records come back whole, in order, and the newest at once") {
  NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  CHECK(!reader.latest());
  TickRecord record;
  CHECK(reader.state_at(0, record) == ReadState::not_yet);
  for (Tick tick = 1; tick <= 10; ++tick) {
    cut_and_publish(writer, volume, tick, {{0, 0, 0}, {1, 1, 1}});
    REQUIRE(reader.latest());
    CHECK(reader.latest()->tick == tick);
  }
  CHECK(reader.state_head() == 10);
  for (std::uint64_t index = 0; index < 10; ++index) {
    REQUIRE(reader.state_at(index, record) == ReadState::ok);
    CHECK(record.seq == 2 * index + 2);
    CHECK(record.tick == index + 1);
    CHECK(record.position_mm[0] == static_cast<double>(index + 1));
    CHECK(
        record.crc32c ==
        crc32c(std::as_bytes(std::span(&record, 1)).subspan(8, offsetof(TickRecord, crc32c) - 8)));
  }
  CHECK(reader.state_at(10, record) == ReadState::not_yet);
}

TEST_CASE("an overrun of the state ring is told exactly: slots are readable, one older is not") {
  NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  constexpr std::uint64_t kPublished = 3 * kStateSlots + 17;
  for (Tick tick = 1; tick <= kPublished; ++tick) {
    cut_and_publish(writer, volume, tick, {{0, 0, 0}, {1, 1, 1}});
  }
  CHECK(reader.state_head() == kPublished);
  TickRecord record;
  record.tick = 0;
  std::uint64_t lost = 0;
  for (std::uint64_t index = 0; index < kPublished; ++index) {
    const ReadState state = reader.state_at(index, record);
    if (state == ReadState::overrun) ++lost;
    if (state == ReadState::ok) CHECK(record.tick == index + 1);
  }
  CHECK(lost == kPublished - kStateSlots);
  CHECK(reader.state_at(kPublished - kStateSlots, record) == ReadState::ok);
  CHECK(reader.state_at(kPublished - kStateSlots - 1, record) == ReadState::overrun);
  CHECK(record.tick == kPublished - kStateSlots + 1);  // untouched by the overrun
}

TEST_CASE("two arms have a ring each, and an index is the same tick in both") {
  NoiseVolume volume({8, 8, 8});
  SegmentSpec spec = spec_of(volume);
  spec.arms = 2;
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentReader reader = SegmentReader::map(writer.fd());
  CHECK(reader.info().arms == 2);
  CHECK(!reader.latest(1));
  constexpr std::uint64_t kPublished = kStateSlots + 5;
  for (Tick tick = 1; tick <= kPublished; ++tick) {
    cut_and_publish(writer, volume, tick, {{0, 0, 0}, {1, 1, 1}}, 2);
    REQUIRE(reader.latest(1));
    CHECK(reader.latest(1)->position_mm[0] == -static_cast<double>(tick));
    CHECK(reader.latest()->position_mm[0] == static_cast<double>(tick));
  }
  CHECK(reader.state_head(1) == kPublished);
  TickRecord first, second;
  for (std::uint64_t index = 0; index < kPublished; ++index) {
    CAPTURE(index);
    const ReadState expected = index < 5 ? ReadState::overrun : ReadState::ok;
    CHECK(reader.state_at(index, first) == expected);
    CHECK(reader.state_at(index, second, 1) == expected);
    if (expected != ReadState::ok) continue;
    CHECK(record_index(first) == index);
    CHECK(second.seq == first.seq);
    CHECK(second.tick == first.tick);
    CHECK(second.crc32c == tick_record_crc(second));
    REQUIRE(reader.second_of(first));
    CHECK(reader.second_of(first)->position_mm[0] == -first.position_mm[0]);
  }
  first.seq = 2;  // of index 0, which has left the ring
  CHECK(!reader.second_of(first));
}

TEST_CASE("the second arm's record is there before the first's, and both in the same tick") {
  NoiseVolume volume({8, 8, 8});
  SegmentSpec spec = spec_of(volume);
  spec.arms = 2;
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentReader reader = SegmentReader::map(writer.fd());
  TickRecord record{};
  record.tick = 1;
  writer.begin_tick(1);
  writer.publish_state(record, 1);
  CHECK(reader.state_head(1) == 1);
  CHECK(reader.state_head() == 0);
  writer.publish_state(record);
  REQUIRE(reader.latest());
  CHECK(reader.second_of(*reader.latest()));
}

TEST_CASE("a segment of one arm has no second ring, and its parts lie where they lay") {
  NoiseVolume volume({8, 8, 8});
  const SegmentPlan plan = plan_segment(spec_of(volume));
  CHECK(plan.header.off_state_2 == 0);
  CHECK(plan.header.off_dirty ==
        plan.header.off_state + std::uint64_t{kStateSlots} * sizeof(TickRecord));
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  cut_and_publish(writer, volume, 1, {{0, 0, 0}, {1, 1, 1}});
  CHECK(reader.info().arms == 1);
  TickRecord record;
  CHECK(reader.state_head(1) == 0);
  CHECK(reader.state_head(7) == 0);
  CHECK(!reader.latest(1));
  CHECK(reader.state_at(0, record, 1) == ReadState::not_yet);
  CHECK(!reader.second_of(*reader.latest()));
}

TEST_CASE("a dirty record names the box, the cause, the bricks and the content") {
  NoiseVolume volume({40, 20, 20});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  writer.begin_tick(3);
  writer.end_tick(77);
  writer.begin_tick(4);
  const VoxelBox beyond{{-3, 5, 6}, {9, 8, 99}};
  writer.publish_box(0, volume.density, beyond, 42, DirtyCause::load);
  writer.publish_box(0, volume.density, VoxelBox{{5, 5, 5}, {5, 9, 9}}, 42);  // empty: not recorded
  writer.end_tick(78);
  REQUIRE(reader.dirty_head() == 1);
  DirtyRecord record;
  REQUIRE(reader.dirty_at(0, record) == ReadState::ok);
  CHECK(record.tick == 4);
  CHECK(record.time_ns == 77);
  CHECK(std::vector(record.lo, record.lo + 3) == std::vector<std::uint16_t>{0, 5, 6});
  CHECK(std::vector(record.hi, record.hi + 3) == std::vector<std::uint16_t>{9, 8, 20});
  CHECK(record.removed == 42);
  CHECK(record.volume == 0);
  CHECK(record.cause == static_cast<std::uint16_t>(DirtyCause::load));
  CHECK(record.bricks == 2 * 1 * 3);
  CHECK(record.box_hash == box_hash(volume.density, volume.grid, {{0, 5, 6}, {9, 8, 20}}));
  CHECK(reader.dirty_at(1, record) == ReadState::not_yet);
}

TEST_CASE("heartbeat and lifecycle follow the writer") {
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  writer.begin_tick(1);
  writer.end_tick(123456);
  CHECK(reader.heartbeat_ns() == 123456);
  for (const Lifecycle life : {Lifecycle::run, Lifecycle::hold, Lifecycle::clean_end}) {
    writer.set_lifecycle(life);
    CHECK(reader.lifecycle() == life);
  }
}

}  // namespace kerf::ring_test
