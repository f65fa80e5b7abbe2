// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <thread>

#include <doctest/doctest.h>
#include <unistd.h>

#include "shared/segment/reader.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::mirror_test {

using namespace kerf::test;

TEST_CASE("a reader finds in the segment what the writer was given") {
  NoiseVolume tooth({20, 9, 5});
  tooth.labels.assign(tooth.density.size(), 3);
  const NoiseVolume jaw({8, 8, 8}, 2);
  SegmentSpec spec = spec_of(tooth);
  spec.volumes.push_back(jaw.spec());
  spec.volumes[1].origin_mm = {1, -2, 3.5};
  spec.volumes[1].spacing_mm = {0.1, 0.2, 0.3};
  spec.volumes[1].orientation = {0, 0, 1, 0};
  spec.volumes[1].iso = 12345;
  spec.volumes[1].material = 4;
  const SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentReader reader = SegmentReader::map(writer.fd());
  const SegmentInfo& info = reader.info();
  CHECK(info.session_id == writer.session_id());
  CHECK(info.config_hash == 0x1234);
  CHECK(info.tick_ns == 1'000'000);
  CHECK(info.build_id == "test");
  CHECK(info.scene_json == spec.scene_json);
  REQUIRE(info.volumes.size() == 2);
  CHECK(info.volumes[0].grid == tooth.grid);
  CHECK(info.volumes[0].bricks.count() == 3 * 2 * 1);
  CHECK(info.volumes[0].initial_hash == density_hash(tooth.density));
  CHECK(info.volumes[0].has_labels);
  const auto labels = reader.labels(0);
  CHECK(std::vector<Label>(labels.begin(), labels.end()) == tooth.labels);
  CHECK(info.volumes[1].origin_mm == spec.volumes[1].origin_mm);
  CHECK(info.volumes[1].spacing_mm == spec.volumes[1].spacing_mm);
  CHECK(info.volumes[1].orientation == spec.volumes[1].orientation);
  CHECK(info.volumes[1].iso == 12345);
  CHECK(info.volumes[1].material == 4);
  CHECK(!info.volumes[1].has_labels);
  CHECK(reader.labels(1).empty());
  CHECK(reader.lifecycle() == Lifecycle::init);
  VolumeSnapshot snapshot;
  reader.update(1, snapshot);
  CHECK(snapshot.density == jaw.density);
  CHECK(snapshot.consistent);
  CHECK(snapshot.tick == 0);
}

TEST_CASE("volumes of every padding come across, and the padding is zero") {
  for (const std::int32_t n : {1, 7, 8, 9, 161}) {
    CAPTURE(n);
    NoiseVolume volume({n, 9, n < 100 ? n : 7});
    SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentReader reader = SegmentReader::map(writer.fd());
    VolumeSnapshot snapshot;
    reader.update(0, snapshot);
    CHECK(snapshot.density == volume.density);
    CHECK(snapshot.changed.size() == reader.info().volumes[0].bricks.count());

    cut_and_publish(writer, volume, 1, volume.grid.box());
    reader.update(0, snapshot);
    CHECK(snapshot.density == volume.density);
    CHECK(snapshot.tick == 1);

    std::vector<std::byte> bytes(writer.total_bytes());
    REQUIRE(pread(writer.fd(), bytes.data(), bytes.size(), 0) ==
            static_cast<ssize_t>(bytes.size()));
    const SegmentVolumeInfo& info = reader.info().volumes[0];
    const auto* mirror = reinterpret_cast<const Density*>(bytes.data() + info.off_bricks);
    std::uint64_t mirrored = 0;
    std::uint64_t source = 0;
    for (std::size_t i = 0; i < info.bricks.count() * kBrickVoxels; ++i) mirrored += mirror[i];
    for (const Density d : volume.density) source += d;
    CHECK(mirrored == source);
  }
}

TEST_CASE("an update copies the changed bricks and only those") {
  NoiseVolume volume({64, 64, 64});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  VolumeSnapshot snapshot;
  reader.update(0, snapshot);
  cut_and_publish(writer, volume, 1, {{7, 8, 16}, {9, 9, 17}});
  reader.update(0, snapshot);
  const BrickGrid& bricks = reader.info().volumes[0].bricks;
  const std::vector<ChangedBrick> changed(snapshot.changed.begin(), snapshot.changed.end());
  CHECK(changed ==
        std::vector<ChangedBrick>{{bricks.id({0, 1, 2}), {0x80}}, {bricks.id({1, 1, 2}), {0x01}}});
  CHECK(snapshot.density == volume.density);
  reader.update(0, snapshot);
  CHECK(snapshot.changed.empty());
  CHECK(snapshot.consistent);
}

TEST_CASE("boxes of one tick that overlap are published once per brick") {
  NoiseVolume volume({32, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  VolumeSnapshot snapshot;
  reader.update(0, snapshot);
  writer.begin_tick(5);
  volume.cut({{0, 0, 0}, {12, 8, 8}});
  writer.publish_box(0, volume.density, {{0, 0, 0}, {12, 8, 8}}, 1);
  volume.cut({{4, 0, 0}, {20, 8, 8}});
  writer.publish_box(0, volume.density, {{4, 0, 0}, {20, 8, 8}}, 1);
  CHECK(writer.waiting_bricks() == 3);
  writer.end_tick(1);
  reader.update(0, snapshot);
  CHECK(snapshot.density == volume.density);
  CHECK(snapshot.tick == 5);
  CHECK(snapshot.versions ==
        std::vector{stable_version(5), stable_version(5), stable_version(5), stable_version(0)});
}

TEST_CASE("ticks that do not grow still get versions that do") {
  NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  VolumeSnapshot snapshot;
  for (const Tick tick : {Tick{0}, Tick{0}, Tick{7}, Tick{3}}) {
    cut_and_publish(writer, volume, tick, volume.grid.box());
    const Tick before = snapshot.tick;
    reader.update(0, snapshot);
    CHECK(snapshot.tick > before);
    CHECK(snapshot.density == volume.density);
  }
  CHECK(snapshot.tick == 8);
}

TEST_CASE("a reset of the whole volume is spread over ticks, inconsistent until it is whole") {
  NoiseVolume volume({128, 128, 128});  // 4096 bricks
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  VolumeSnapshot snapshot;
  reader.update(0, snapshot);
  volume.fill(9);
  writer.begin_tick(1);
  writer.publish_box(0, volume.density, volume.grid.box(), 0, DirtyCause::reset);
  writer.end_tick(1);
  Tick tick = 1;
  for (; writer.waiting_bricks() != 0; ++tick) {
    reader.update(0, snapshot);
    CHECK(!snapshot.consistent);
    CHECK(snapshot.changed.size() == kMaxBricksPerTick);
    writer.begin_tick(tick + 1);
    writer.end_tick(1);
  }
  CHECK(tick == 4096 / kMaxBricksPerTick);
  reader.update(0, snapshot);
  CHECK(snapshot.consistent);
  CHECK(snapshot.tick == tick);
  CHECK(snapshot.density == volume.density);
}

TEST_CASE("a slow reader skips ticks and never bricks") {
  NoiseVolume volume({40, 33, 17});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  std::mt19937 random(3);
  VolumeSnapshot snapshot;
  for (Tick tick = 1; tick <= 3000; ++tick) {
    cut_and_publish(writer, volume, tick, random_box(random, volume.grid, 6));
    if (tick % 1000 == 0) {
      reader.update(0, snapshot);
      CHECK(snapshot.tick == tick);
      CHECK(snapshot.density == volume.density);
    }
  }
}

TEST_CASE("a snapshot of another session starts anew") {
  const NoiseVolume first({24, 8, 8}, 1);
  const NoiseVolume second({24, 8, 8}, 2);
  VolumeSnapshot snapshot;
  for (const NoiseVolume* volume : {&first, &second}) {
    const SegmentWriter writer = SegmentWriter::create(spec_of(*volume));
    SegmentReader::map(writer.fd()).update(0, snapshot);
    CHECK(snapshot.density == volume->density);
    CHECK(snapshot.changed.size() == 3);
  }
}

TEST_CASE("late joins while cutting goes on equal the source of their tick") {
  NoiseVolume volume({40, 33, 17});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  constexpr Tick kMostTicks = 400'000;
  constexpr int kJoins = 100;
  std::vector<std::atomic<std::uint64_t>> hash(kMostTicks + 1);
  hash[0] = density_hash(volume.density);
  std::atomic<bool> done{false};
  std::atomic<int> joined{0};
  Tick ticks = 0;
  std::thread servo([&] {
    std::mt19937 random(5);
    for (Tick tick = 1; tick <= kMostTicks && joined < kJoins; ++tick) {
      ticks = tick;
      const VoxelBox box = random_box(random, volume.grid, 10);
      volume.cut(box);
      hash[tick] = density_hash(volume.density);
      writer.begin_tick(tick);
      writer.publish_box(0, volume.density, box, 1);
      writer.end_tick(1);
      // A servo rests between ticks; without that, a snapshot of one tick is luck.
      if (tick % 8 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    done = true;
  });
  std::mt19937 random(7);
  while (!done) {
    const SegmentReader reader = SegmentReader::map(writer.fd());
    VolumeSnapshot snapshot;
    reader.update(0, snapshot);
    if (snapshot.consistent) {
      ++joined;
      CHECK(density_hash(snapshot.density) == hash[snapshot.tick]);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
  }
  servo.join();
  CHECK(joined >= kJoins);
  VolumeSnapshot last;
  SegmentReader::map(writer.fd()).update(0, last);
  CHECK(last.tick == ticks);
  CHECK(last.density == volume.density);
}

TEST_CASE("a scene without cutting has no dirty ring and takes no boxes") {
  const NoiseVolume volume({16, 16, 16});
  SegmentSpec spec = spec_of(volume);
  const std::uint64_t with = SegmentWriter::create(spec).total_bytes();
  spec.mirror_updates = false;
  SegmentWriter writer = SegmentWriter::create(spec);
  CHECK(with - writer.total_bytes() == (kDirtySlots - 64) * sizeof(DirtyRecord));
  writer.begin_tick(1);
  writer.end_tick(1);
  VolumeSnapshot snapshot;
  SegmentReader::map(writer.fd()).update(0, snapshot);
  CHECK(snapshot.tick == 1);
  CHECK(snapshot.density == volume.density);
}

}  // namespace kerf::mirror_test
