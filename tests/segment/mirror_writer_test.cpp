// SPDX-License-Identifier: Apache-2.0
// The segment of another machine, rebuilt from what arrives: readers must not see a difference.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <unistd.h>

#include "shared/segment/connection.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/replica_writer.hpp"
#include "shared/segment/server.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::mirror_writer_test {

using namespace kerf::test;

namespace {

/// The remote segment's bytes, from which a test takes what the network would bring.
struct Remote {
  explicit Remote(const SegmentWriter& writer) : bytes(writer.total_bytes()) {
    REQUIRE(pread(writer.fd(), bytes.data(), bytes.size(), 0) ==
            static_cast<ssize_t>(bytes.size()));
    std::memcpy(&header, bytes.data(), sizeof header);
    volumes.resize(header.volume_count);
    std::memcpy(volumes.data(), bytes.data() + header.off_volume_table,
                volumes.size() * sizeof(VolumeDescriptor));
  }
  [[nodiscard]] MirrorSpec spec() const {
    return {.session_id = header.session_id,
            .config_hash = header.config_hash,
            .start_ns = header.start_ns,
            .tick_ns = header.tick_ns,
            .scene_bytes = static_cast<std::uint32_t>(header.scene_bytes),
            .build_id = header.build_id,
            .arms = header.off_state_2 == 0 ? 1U : 2U,
            .volumes = volumes};
  }
  [[nodiscard]] std::span<const std::byte> brick(std::size_t volume, std::uint32_t id) const {
    return std::span(bytes).subspan(volumes[volume].off_bricks + id * 1024UL, 1024);
  }
  [[nodiscard]] std::uint64_t version(std::size_t volume, std::uint32_t id) const {
    std::uint64_t out = 0;
    std::memcpy(&out, bytes.data() + volumes[volume].off_versions + id * 8UL, 8);
    return out;
  }
  /// Everything but the rings, in one pass.
  void copy_to(ReplicaWriter& mirror) const {
    mirror.put_scene(0, std::span(bytes).subspan(header.off_scene, header.scene_bytes));
    mirror.begin_pass(tick_of_version(header.epoch));
    for (std::size_t v = 0; v < volumes.size(); ++v) {
      for (std::uint32_t id = 0; id < volumes[v].brick_count; ++id) {
        mirror.put_brick(v, id, version(v, id), brick(v, id));
      }
    }
    mirror.end_pass(tick_of_version(header.epoch));
  }

  std::vector<std::byte> bytes;
  SegmentHeader header{};
  std::vector<VolumeDescriptor> volumes;
};

/// The labels of a brick as they travel: 512 bytes, zeros beyond the far faces.
std::vector<std::byte> labels_of(const NoiseVolume& volume, std::uint32_t id) {
  const BrickGrid bricks = BrickGrid::of(volume.grid);
  const VoxelBox box = bricks.voxels(id);
  std::vector<std::byte> out(kBrickVoxels);
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
        out[brick_row(y - box.lo.y, z - box.lo.z) * 8 + static_cast<std::size_t>(x - box.lo.x)] =
            std::byte{volume.labels[volume.grid.index(x, y, z)]};
      }
    }
  }
  return out;
}

}  // namespace

TEST_CASE("a mirror has all that the other machine's segment has") {
  NoiseVolume tooth({20, 9, 161});
  std::mt19937 random(9);
  tooth.labels.resize(tooth.density.size());
  for (Label& label : tooth.labels) label = static_cast<Label>(random());
  const NoiseVolume jaw({8, 8, 8}, 2);
  SegmentSpec spec = spec_of(tooth);
  spec.volumes.push_back(jaw.spec());
  spec.volumes[1].origin_mm = {1, -2, 3.5};
  spec.volumes[1].material = 4;
  SegmentWriter writer = SegmentWriter::create(spec);
  cut_and_publish(writer, tooth, 7, {{3, 3, 3}, {12, 9, 90}});
  const Remote remote(writer);

  ReplicaWriter mirror = ReplicaWriter::create(remote.spec());
  remote.copy_to(mirror);
  for (std::uint32_t id = 0; id < remote.volumes[0].brick_count; ++id) {
    mirror.put_labels(0, id, labels_of(tooth, id));
  }
  const SegmentReader theirs = SegmentReader::map(writer.fd());
  const SegmentReader ours = SegmentReader::map(mirror.fd());
  CHECK(ours.info().session_id == theirs.info().session_id);
  CHECK(ours.info().config_hash == theirs.info().config_hash);
  CHECK(ours.info().scene_json == theirs.info().scene_json);
  CHECK(ours.info().build_id == theirs.info().build_id);
  CHECK(ours.info().tick_ns == theirs.info().tick_ns);
  REQUIRE(ours.info().volumes.size() == 2);
  CHECK(ours.info().volumes[0].initial_hash == theirs.info().volumes[0].initial_hash);
  CHECK(ours.info().volumes[1].origin_mm == theirs.info().volumes[1].origin_mm);
  CHECK(ours.info().volumes[1].material == 4);
  CHECK(std::vector<Label>(ours.labels(0).begin(), ours.labels(0).end()) == tooth.labels);
  CHECK(ours.labels(1).empty());
  for (const std::size_t v : {0U, 1U}) {
    VolumeSnapshot a, b;
    theirs.update(v, a), ours.update(v, b);
    CHECK(b.density == a.density);
    CHECK(b.versions == a.versions);
    CHECK(b.consistent);
    CHECK(b.tick == 7);
  }
}

TEST_CASE("a mirror of the same plan has the same bytes") {
  NoiseVolume volume({33, 20, 9});
  SegmentSpec spec = spec_of(volume);
  SUBCASE("one arm") {
    spec.arms = 1;
  }
  SUBCASE("two arms") {
    spec.arms = 2;
  }
  SegmentWriter writer = SegmentWriter::create(spec);
  cut_and_publish(writer, volume, 1, {{0, 0, 0}, {30, 3, 9}}, spec.arms);
  const Remote remote(writer);
  ReplicaWriter mirror = ReplicaWriter::create(remote.spec());
  remote.copy_to(mirror);
  const SegmentReader theirs = SegmentReader::map(writer.fd());
  TickRecord record;
  if (spec.arms == 2) {
    REQUIRE(theirs.state_at(0, record, 1) == ReadState::ok);
    mirror.put_record(0, record, 1);
  }
  REQUIRE(theirs.state_at(0, record) == ReadState::ok);
  mirror.put_record(0, record);
  DirtyRecord box;
  REQUIRE(theirs.dirty_at(0, box) == ReadState::ok);
  mirror.put_record(0, box);
  mirror.beat(theirs.heartbeat_ns());
  mirror.set_lifecycle(theirs.lifecycle());
  REQUIRE(mirror.total_bytes() == writer.total_bytes());
  std::vector<std::byte> ours(mirror.total_bytes());
  REQUIRE(pread(mirror.fd(), ours.data(), ours.size(), 0) == static_cast<ssize_t>(ours.size()));
  CHECK(ours == remote.bytes);
}

TEST_CASE("readers of a mirror know that a pass is not whole") {
  NoiseVolume volume({24, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  ReplicaWriter mirror = ReplicaWriter::create(Remote(writer).spec());
  const SegmentReader reader = SegmentReader::map(mirror.fd());
  VolumeSnapshot snapshot;
  reader.update(0, snapshot);
  CHECK(!snapshot.consistent);  // nothing has arrived
  Remote(writer).copy_to(mirror);
  reader.update(0, snapshot);
  CHECK(snapshot.consistent);
  CHECK(snapshot.tick == 0);

  cut_and_publish(writer, volume, 5, volume.grid.box());
  const Remote later(writer);
  mirror.begin_pass(5);
  mirror.put_brick(0, 1, later.version(0, 1), later.brick(0, 1));
  reader.update(0, snapshot);
  CHECK(!snapshot.consistent);
  REQUIRE(snapshot.changed.size() == 1);  // a brick is whole by itself
  CHECK(snapshot.changed.begin()->id == 1);
  mirror.put_brick(0, 0, later.version(0, 0), later.brick(0, 0));
  mirror.put_brick(0, 2, later.version(0, 2), later.brick(0, 2));
  mirror.end_pass(5);
  reader.update(0, snapshot);
  CHECK(snapshot.consistent);
  CHECK(snapshot.tick == 5);
  CHECK(snapshot.density == volume.density);
  mirror.begin_pass(6), mirror.end_pass(6);
  reader.update(0, snapshot);
  CHECK(snapshot.tick == 6);
  CHECK(snapshot.changed.empty());
}

TEST_CASE("a reader beside passes that never rest takes only whole ones for consistent") {
  NoiseVolume volume({16, 16, 16});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const Remote remote(writer);
  ReplicaWriter mirror = ReplicaWriter::create(remote.spec());
  remote.copy_to(mirror);
  // In the pass of tick t every voxel of every brick is t.
  std::atomic<bool> done{false};
  std::thread passes([&] {
    std::vector<Density> brick(kBrickVoxels);
    for (Tick tick = 1; !done; ++tick) {
      brick.assign(kBrickVoxels, static_cast<Density>(tick));
      mirror.begin_pass(tick);
      for (std::uint32_t id = 0; id < 8; ++id) {
        mirror.put_brick(0, id, stable_version(tick), std::as_bytes(std::span(brick)));
      }
      mirror.end_pass(tick);
      if (tick % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  const SegmentReader reader = SegmentReader::map(mirror.fd());
  VolumeSnapshot snapshot;
  int whole = 0, mixed = 0;
  for (int i = 0; i < 2'000'000 && whole < 300; ++i) {
    reader.update(0, snapshot);
    if (!snapshot.consistent || snapshot.tick == 0) continue;
    ++whole;
    const auto expected = static_cast<Density>(snapshot.tick);
    mixed += std::count(snapshot.density.begin(), snapshot.density.end(), expected) != 16 * 16 * 16;
  }
  done = true;
  passes.join();
  CHECK(whole == 300);
  CHECK(mixed == 0);
}

TEST_CASE("records keep their indices, and what never came reads as lost") {
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  ReplicaWriter mirror = ReplicaWriter::create(Remote(writer).spec());
  const SegmentReader reader = SegmentReader::map(mirror.fd());
  CHECK(!reader.latest());
  TickRecord record{};
  const auto put = [&](std::uint64_t index) {
    record.tick = index + 1;
    record.crc32c = 77;  // the sender's, whose clock was another
    mirror.put_record(index, record);
  };
  put(1'000'000);  // a join long after the start
  CHECK(reader.state_head() == 1'000'001);
  CHECK(reader.latest()->tick == 1'000'001);
  TickRecord out;
  CHECK(reader.state_at(999'999, out) == ReadState::overrun);
  CHECK(reader.state_at(1'000'001 - kStateSlots, out) == ReadState::overrun);
  put(1'000'004);
  CHECK(reader.state_at(1'000'000, out) == ReadState::ok);
  for (const std::uint64_t lost : {1'000'001U, 1'000'002U, 1'000'003U}) {
    CHECK(reader.state_at(lost, out) == ReadState::overrun);
  }
  put(1'000'003);  // too late
  CHECK(reader.latest()->tick == 1'000'005);
  put(1'000'001 + kStateSlots);  // the slot of a lost one, one round on
  CHECK(reader.state_at(1'000'001 + kStateSlots, out) == ReadState::ok);
  CHECK(reader.state_at(1'000'000 + kStateSlots, out) == ReadState::overrun);
  put(5'000'000'000'000);  // longer than the ring
  CHECK(reader.latest()->tick == 5'000'000'000'001);
  CHECK(reader.state_at(5'000'000'000'000 - kStateSlots + 1, out) == ReadState::overrun);

  DirtyRecord box{};
  box.tick = 4;
  mirror.put_record(3, box);
  DirtyRecord found;
  CHECK(reader.dirty_at(3, found) == ReadState::ok);
  CHECK(found.tick == 4);
  CHECK(reader.dirty_at(2, found) == ReadState::overrun);
}

TEST_CASE("a mirror refuses a plan or a place that cannot be") {
  const NoiseVolume volume({9, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const Remote remote(writer);
  ReplicaWriter mirror = ReplicaWriter::create(remote.spec());
  const auto brick = remote.brick(0, 0);
  CHECK_THROWS_AS(mirror.put_brick(1, 0, 2, brick), SegmentError);
  CHECK_THROWS_AS(mirror.put_brick(0, 2, 2, brick), SegmentError);
  CHECK_THROWS_AS(mirror.put_brick(0, 0, 3, brick), SegmentError);
  CHECK_THROWS_AS(mirror.put_brick(0, 0, 0, brick), SegmentError);
  CHECK_THROWS_AS(mirror.put_brick(0, 0, 2, brick.first(1022)), SegmentError);
  CHECK_THROWS_AS(mirror.put_labels(0, 0, brick.first(512)), SegmentError);  // has none
  CHECK_THROWS_AS(mirror.put_scene(1, std::span(remote.bytes).first(remote.header.scene_bytes)),
                  SegmentError);
  CHECK_THROWS_AS(mirror.put_scene(~std::uint64_t{0}, brick), SegmentError);
  const auto refused = [&remote](auto change) {
    MirrorSpec spec = remote.spec();
    change(spec);
    CHECK_THROWS_AS(static_cast<void>(ReplicaWriter::create(spec)), SegmentError);
  };
  refused([](MirrorSpec& s) { s.volumes.clear(); });
  refused([](MirrorSpec& s) { s.volumes.resize(9, s.volumes[0]); });
  refused([](MirrorSpec& s) { s.tick_ns = 0; });
  refused([](MirrorSpec& s) { s.arms = 0; });
  refused([](MirrorSpec& s) { s.arms = 3; });
  refused([](MirrorSpec& s) { s.scene_bytes = kMaxSceneBytes + 1; });
  refused([](MirrorSpec& s) { s.volumes[0].brick_count = 0xffffffff; });
  refused([](MirrorSpec& s) { s.volumes[0].nx = 0; });
  refused([](MirrorSpec& s) { s.volumes[0].nx = s.volumes[0].ny = s.volumes[0].nz = 65535; });
  refused([](MirrorSpec& s) { s.volumes[0].spacing_mm[1] = std::nan(""); });
  refused([](MirrorSpec& s) { s.volumes[0].orientation[3] = 2; });
  refused([](MirrorSpec& s) { s.most_bytes = 4096; });
}

TEST_CASE("a mirror is handed over like a segment, and somebody else answers its commands") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const Remote remote(writer);
  ReplicaWriter mirror = ReplicaWriter::create(remote.spec());
  remote.copy_to(mirror);
  SegmentServer server("far", mirror.fd(), mirror.session_id(), [](const SegmentCommand& command) {
    return command.argument == 3 ? Reply{ReplyStatus::accepted, 42} : Reply{ReplyStatus::busy, 0};
  });
  SegmentConnection connection = connect_segment("far");
  CHECK(connection.reader().info().session_id == writer.session_id());
  VolumeSnapshot snapshot;
  connection.reader().update(0, snapshot);
  CHECK(snapshot.density == volume.density);
  const Reply reply = connection.send({.kind = CommandKind::select_tool, .argument = 3});
  CHECK(reply.status == ReplyStatus::accepted);
  CHECK(reply.index == 42);
  CHECK(connection.send({.argument = 4}).status == ReplyStatus::busy);
  CHECK(!server.take_command());
}

}  // namespace kerf::mirror_writer_test
