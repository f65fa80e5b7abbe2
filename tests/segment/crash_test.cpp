// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <csignal>
#include <thread>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/segment/reader.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::crash_test {

using namespace kerf::test;

TEST_CASE("SIGKILL of the writer at any moment leaves readers bounded and never torn") {
  constexpr VoxelGrid kGrid{64, 64, 32};  // 256 bricks, all of them in every tick
  std::mt19937 random(11);
  int stopped_in_tick = 0;
  for (int trial = 0; trial < 20; ++trial) {
    NoiseVolume volume(kGrid);
    volume.fill(0);
    SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentReader reader = SegmentReader::map(writer.fd());
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      for (Tick tick = 1;; ++tick) {
        volume.fill(static_cast<Density>(tick));
        writer.begin_tick(tick);
        writer.publish_box(0, volume.density, kGrid.box(), 0);
        TickRecord record{};
        record.tick = tick;
        writer.publish_state(record);
        writer.end_tick(tick);
      }
    }
    while (reader.state_head() == 0) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 5000));
    kill(child, SIGKILL);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);

    VolumeSnapshot snapshot;
    reader.update(0, snapshot);
    const auto record = reader.latest();
    REQUIRE(record);
    CHECK(record->tick == reader.state_head());
    stopped_in_tick += snapshot.consistent ? 0 : 1;
    const BrickGrid& bricks = reader.info().volumes[0].bricks;
    for (const auto& [id, voxels] : snapshot.changed) {
      const auto expected = static_cast<Density>(tick_of_version(snapshot.versions[id]));
      const VoxelBox box = bricks.voxels(id);
      bool whole = true;
      for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
        for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
          for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
            whole &= snapshot.density[kGrid.index(x, y, z)] == expected;
          }
        }
      }
      CHECK(whole);
    }
  }
  MESSAGE(stopped_in_tick, " of 20 stopped inside a publication");
}

}  // namespace kerf::crash_test
