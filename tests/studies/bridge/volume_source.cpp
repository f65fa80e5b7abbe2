// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/bridge/volume_source.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/connection.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/studies/bridge/two_machines.hpp"

namespace kerf::two_machines {
namespace {

constexpr std::int32_t kBricksAcross = 32;
constexpr std::uint64_t kRow = 25, kRows = 20, kLayers = 4;  // the 2000 bricks that are milled

[[nodiscard]] std::uint64_t mixed(std::uint64_t z) noexcept {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

[[nodiscard]] SegmentSpec spec_of(const VoxelGrid& grid, const std::vector<Density>& density) {
  SegmentSpec out;
  SegmentVolumeSpec volume;
  volume.grid = grid;
  volume.spacing_mm = {0.1, 0.1, 0.1};
  volume.density = density;
  out.volumes = {volume};
  out.scene_json = R"({"tools":[]})";
  out.build_id = "kerf-studies bridge";
  return out;
}

constexpr std::int64_t kPollNs = 2'000'000;

/// Polls `holds` until it does, or `patience` is over.
template <class Condition>
[[nodiscard]] bool holds_within(std::chrono::milliseconds patience, Condition holds) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    pause(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace

MilledVolume::MilledVolume(const std::string& name, Load load, std::int32_t layers)
    : load_(load),
      grid_{kBricksAcross * kBrickEdge, kBricksAcross * kBrickEdge, layers * kBrickEdge},
      bricks_(BrickGrid::of(grid_)),
      solid_(paint(100)),
      milled_(paint(88)),
      volume_(solid_),
      writer_(SegmentWriter::create(spec_of(grid_, volume_))),
      server_(name, writer_),
      start_ns_(monotonic_ns()),
      servo_([this] { run(); }) {}

MilledVolume::~MilledVolume() {
  stop_ = true;
  servo_.join();
}

/// A ball with 3 bits of noise, and cells of 30 voxels of which every other is `groove` wide.
std::vector<Density> MilledVolume::paint(double groove) const {
  std::vector<Density> out(grid_.voxel_count());
  std::size_t at = 0;
  for (std::int32_t z = 0; z < grid_.nz; ++z) {
    for (std::int32_t y = 0; y < grid_.ny; ++y) {
      for (std::int32_t x = 0; x < grid_.nx; ++x, ++at) {
        const double edge = (x + y) / 30 % 2 != 0 ? groove : 100;
        const double r = std::hypot(x - 128.0, y - 128.0, 1.3 * (z - grid_.nz / 2.0));
        const double density = std::clamp((edge - r) * 25 + 128, 0.0, 200.0);
        if (density <= 0) continue;
        out[at] =
            static_cast<Density>((static_cast<std::uint64_t>(density) + (mixed(at) & 7)) << 8);
      }
    }
  }
  return out;
}

/// The tool's next bricks take the other look, and a low bit that is another each time.
void MilledVolume::mill(Tick tick) {
  const std::uint64_t step = load_ == Load::sweep ? 180 : 1;
  head_ += step;
  const std::uint64_t layer0 = bricks_.bz < 12 ? 0 : 2;
  for (std::uint64_t i = head_; i < head_ + std::max<std::uint64_t>(step, 24);) {
    const std::uint64_t x = i % kRow,
                        run = std::min(kRow - x, head_ + std::max<std::uint64_t>(step, 24) - i);
    const auto bx = static_cast<std::int32_t>(x + 3);
    const auto by = static_cast<std::int32_t>(i / kRow % kRows + 6);
    const auto bz = static_cast<std::int32_t>((i / kRow / kRows % kLayers + layer0) %
                                              static_cast<std::uint64_t>(bricks_.bz));
    const VoxelBox box{{bx * kBrickEdge, by * kBrickEdge, bz * kBrickEdge},
                       {(bx + static_cast<std::int32_t>(run)) * kBrickEdge, (by + 1) * kBrickEdge,
                        (bz + 1) * kBrickEdge}};
    const std::vector<Density>& look = i / (kRow * kRows * kLayers) % 2 != 0 ? solid_ : milled_;
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const std::size_t from = grid_.index(box.lo.x, y, z);
        std::copy_n(look.begin() + static_cast<std::ptrdiff_t>(from), run * kBrickEdge,
                    volume_.begin() + static_cast<std::ptrdiff_t>(from));
      }
    }
    for (std::int32_t brick = box.lo.x; brick < box.hi.x; brick += kBrickEdge) {
      volume_[grid_.index(brick, box.lo.y, box.lo.z)] ^= static_cast<Density>(tick & 7);
    }
    writer_.publish_box(0, volume_, box, 1);
    i += run;
  }
}

void MilledVolume::run() {
  std::int64_t frame = 0;
  for (Tick tick = 1; !stop_; ++tick) {
    sleep_until_ns(time_of(tick));
    if (take_times_) {
      taken_times_ = times_;
      times_ = {};
      take_times_ = false;
    }
    const std::int64_t begin_ns = monotonic_ns();
    writer_.begin_tick(tick);
    const bool due = static_cast<std::int64_t>(tick) * 60 / 1000 > frame;
    if (due) ++frame;
    if (due && !still_) mill(tick);
    TickRecord record{};
    record.tick = tick;
    record.start_ns = static_cast<std::uint64_t>(begin_ns);
    record.orientation[3] = 1;
    record.position_mm[0] = static_cast<double>(tick % 1000);
    writer_.publish_state(record);
    writer_.end_tick(static_cast<std::uint64_t>(monotonic_ns()));
    times_.record(monotonic_ns() - begin_ns);
    if (still_ && writer_.waiting_bricks() == 0) is_still_ = true;
  }
}

void MilledVolume::hold_still() {
  is_still_ = false;  // of an earlier time
  for (still_ = true; !is_still_;) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void MilledVolume::go_on() {
  is_still_ = still_ = false;
}

std::uint64_t MilledVolume::density_hash() const {
  return kerf::density_hash(volume_);
}

Histogram MilledVolume::take_publish_times() {
  for (take_times_ = true; take_times_;) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return taken_times_;
}

FarViewer::FarViewer(std::string name, const MilledVolume& source)
    : name_(std::move(name)), source_(source), thread_([this] { run(); }) {}

FarViewer::~FarViewer() {
  stop_ = true;
  thread_.join();
}

bool FarViewer::joins_within(std::chrono::milliseconds patience) const {
  return holds_within(patience, [this] {
    const std::lock_guard lock(mutex_);
    return seen_;
  });
}

bool FarViewer::equals_within(std::uint64_t density_hash,
                              std::chrono::milliseconds patience) const {
  Tick looked_at = 0;
  return holds_within(patience, [&] {
    const std::lock_guard lock(mutex_);
    if (!snapshot_.consistent || std::exchange(looked_at, snapshot_.tick) == snapshot_.tick) {
      return false;
    }
    return kerf::density_hash(snapshot_.density) == density_hash;
  });
}

void FarViewer::begin_ages() {
  const std::lock_guard lock(mutex_);
  ages_ = {};
  counts_ = true;
}

Histogram FarViewer::take_ages() {
  const std::lock_guard lock(mutex_);
  counts_ = false;
  return ages_;
}

void FarViewer::run() {
  std::optional<SegmentConnection> connection;
  for (std::int64_t at_ns = monotonic_ns(); !stop_; at_ns += kPollNs) {
    sleep_until_ns(at_ns);
    try {  // the last state stays until there is a newer one
      if (!connection || !connection->alive()) connection = connect_segment(name_);
    } catch (const SegmentError&) {  // not there yet, or just now replaced
    }
    const std::lock_guard lock(mutex_);
    if (connection && connection->reader().info().session_id == source_.session_id()) {
      connection->reader().update(0, snapshot_);
      if (snapshot_.consistent) {
        newest_ = snapshot_.tick;
        seen_ = true;
      }
    }
    if (counts_ && seen_) ages_.record(monotonic_ns() - source_.time_of(newest_));
  }
}

}  // namespace kerf::two_machines
