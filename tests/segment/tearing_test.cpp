// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include <doctest/doctest.h>
#include <sys/mman.h>

#include "shared/segment/reader.hpp"
#include "shared/segment/seqlock.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::tearing_test {

using namespace kerf::test;

namespace {

using Clock = std::chrono::steady_clock;
constexpr VoxelGrid kGrid{32, 32, 32};  // 64 bricks: small, so that the two meet often
constexpr auto kDuration = std::chrono::milliseconds(1500);

/// Publishes, flat out, volumes that hold one number everywhere: the tick, mod 2^16.
class FlatOutWriter {
 public:
  FlatOutWriter()
      : volume_(kGrid), writer_((volume_.fill(0), SegmentWriter::create(spec_of(volume_)))) {
    servo_ = std::thread([this] {
      for (Tick tick = 1; !stop_; ++tick) {
        volume_.fill(static_cast<Density>(tick));
        writer_.begin_tick(tick);
        writer_.publish_box(0, volume_.density, kGrid.box(), 0);
        TickRecord record{};
        record.tick = tick;
        record.port_energy_j = static_cast<double>(tick);
        record.plane_count = static_cast<std::uint32_t>(tick);
        writer_.publish_state(record);
        writer_.end_tick(tick);
      }
    });
  }
  ~FlatOutWriter() {
    stop_ = true;
    servo_.join();
  }
  FlatOutWriter(const FlatOutWriter&) = delete;
  FlatOutWriter& operator=(const FlatOutWriter&) = delete;
  [[nodiscard]] const SegmentWriter& writer() const { return writer_; }

 private:
  NoiseVolume volume_;
  SegmentWriter writer_;
  std::atomic<bool> stop_{false};
  std::thread servo_;
};

}  // namespace

TEST_CASE("a reader that chases a writer flat out never keeps a torn brick or record") {
  const FlatOutWriter servo;
  const SegmentReader reader = SegmentReader::map(servo.writer().fd());
  const BrickGrid bricks = BrickGrid::of(kGrid);
  VolumeSnapshot snapshot;
  std::uint64_t kept = 0;
  std::uint64_t torn = 0;
  std::uint64_t torn_records = 0;
  std::uint64_t consistent = 0;
  std::uint64_t mixed = 0;
  // On a busy machine it takes longer until so many are kept.
  const auto end = Clock::now() + kDuration;
  while (Clock::now() < end || kept <= 1000) {
    const std::vector<std::uint64_t> before = snapshot.versions;
    reader.update(0, snapshot);
    for (const auto& [id, voxels] : snapshot.changed) {
      const auto expected = static_cast<Density>(tick_of_version(snapshot.versions[id]));
      const VoxelBox box = bricks.voxels(id);
      bool whole = before.empty() || snapshot.versions[id] > before[id];
      for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
        for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
          const auto row =
              snapshot.density.begin() + static_cast<std::ptrdiff_t>(kGrid.index(box.lo.x, y, z));
          whole &= std::all_of(row, row + kBrickEdge, [&](Density d) { return d == expected; });
        }
      }
      torn += whole ? 0 : 1;
      ++kept;
    }
    if (snapshot.consistent) {
      ++consistent;
      const auto expected = static_cast<Density>(snapshot.tick);
      mixed += std::all_of(snapshot.density.begin(), snapshot.density.end(),
                           [&](Density d) { return d == expected; })
                   ? 0
                   : 1;
    }
    if (const auto record = reader.latest()) {
      torn_records += record->port_energy_j == static_cast<double>(record->tick) &&
                              record->plane_count == static_cast<std::uint32_t>(record->tick)
                          ? 0
                          : 1;
    }
  }
  MESSAGE(kept, " bricks kept, ", consistent, " snapshots of one tick");
  CHECK(torn == 0);
  CHECK(torn_records == 0);
  CHECK(mixed == 0);
}

TEST_CASE("negative control: a reader that ignores the versions does find torn bricks") {
  const FlatOutWriter servo;
  const SegmentReader reader = SegmentReader::map(servo.writer().fd());
  const std::size_t bytes = servo.writer().total_bytes();
  void* const at = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, servo.writer().fd(), 0);
  REQUIRE(at != MAP_FAILED);
  std::byte* const content = static_cast<std::byte*>(at) + reader.info().volumes[0].off_bricks;
  std::array<Density, kBrickVoxels> brick{};
  std::uint64_t torn = 0;
  const auto end = Clock::now() + 4 * kDuration;
  while (torn == 0 && Clock::now() < end) {
    for (std::size_t id = 0; id < BrickGrid::of(kGrid).count(); ++id) {
      shared_words::load(brick.data(), content + id * sizeof brick, sizeof brick);
      torn +=
          std::all_of(brick.begin(), brick.end(), [&](Density d) { return d == brick[0]; }) ? 0 : 1;
    }
  }
  CHECK(torn > 0);
  munmap(at, bytes);
}

}  // namespace kerf::tearing_test
