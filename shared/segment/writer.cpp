// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/writer.hpp"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <utility>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/seqlock.hpp"
#include "shared/volume/changed_bricks.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace words = shared_words;

/// One volume of the servo: where its bricks lie in the segment, and which ones wait.
struct MirroredVolume {
  BrickGrid bricks;
  std::byte* versions = nullptr;
  std::byte* content = nullptr;
  std::span<const Density> linear;
  BrickSet dirty;

  /// Copies the rows of brick `id` that `changed` touches. Whole rows of 8, because a word of the
  /// segment holds four voxels and a row lies in one cache line or two.
  void copy(std::uint32_t id, const VoxelBox& changed, Tick tick) const noexcept {
    const VoxelBox box = bricks.voxels(id);
    const VoxelBox rows = box.clipped(changed);
    const auto row_voxels = static_cast<std::size_t>(box.hi.x - box.lo.x);
    std::byte* const version = versions + std::size_t{id} * sizeof(std::uint64_t);
    std::byte* const brick = content + std::size_t{id} * kBrickVoxels * sizeof(Density);
    words::open(version, writing_version(tick));
    for (std::int32_t z = rows.lo.z; z < rows.hi.z; ++z) {
      for (std::int32_t y = rows.lo.y; y < rows.hi.y; ++y) {
        BrickRow row{};  // zeros beyond the far face
        copy_row(row.data(), linear.data() + bricks.grid.index(box.lo.x, y, z), row_voxels);
        words::store(brick + brick_row(y - box.lo.y, z - box.lo.z) * sizeof row, row.data(),
                     sizeof row);
      }
    }
    words::close(version, stable_version(tick));
  }
};

}  // namespace

struct SegmentWriter::State {
  SegmentMemory memory;
  SegmentHeader header;  // as written, with offsets and session
  std::vector<MirroredVolume> volumes;
  std::array<RecordRing<TickRecord>, kMaxArms> ticks;  // per arm; `slots` null: no such arm
  RecordRing<DirtyRecord> boxes;
  Tick tick = 0;
  std::uint64_t last_end_ns = 0;
  std::size_t first_volume = 0;  // copied first in this tick; round-robin
  bool mirror_updates = true;

  [[nodiscard]] std::byte* hot(std::size_t offset) const noexcept {
    return memory.bytes().data() + offset;
  }
  [[nodiscard]] std::uint32_t waiting() const noexcept {
    std::uint32_t sum = 0;
    for (const MirroredVolume& volume : volumes) sum += volume.dirty.waiting();
    return sum;
  }
};

SegmentWriter SegmentWriter::create(const SegmentSpec& spec, bool virtual_time) {
  SegmentPlan plan = plan_segment(spec);
  SegmentHeader& header = plan.header;
  auto state = std::make_unique<State>(State{
      .memory = SegmentMemory::create(header.total_bytes),
      .header = {},
      .volumes = {},
      .ticks = {},
      .boxes = {},
      .last_end_ns = static_cast<std::uint64_t>(monotonic_ns()),
      .mirror_updates = spec.mirror_updates,
  });
  std::byte* const base = state->memory.bytes().data();
  header.session_id = random_session_id();
  header.start_ns = virtual_time ? 0 : state->last_end_ns;

  for (std::size_t i = 0; i < plan.volumes.size(); ++i) {
    const SegmentVolumeSpec& source = spec.volumes[i];
    VolumeDescriptor& descriptor = plan.volumes[i];
    descriptor.initial_hash = density_hash(source.density);
    const BrickGrid bricks = BrickGrid::of(source.grid);
    state->volumes.push_back({.bricks = bricks,
                              .versions = base + descriptor.off_versions,
                              .content = base + descriptor.off_bricks,
                              .linear = source.density,
                              .dirty = BrickSet(spec.mirror_updates ? bricks : BrickGrid{})});
    for (std::uint32_t id = 0; id < bricks.count(); ++id)
      state->volumes.back().copy(id, source.grid.box(), 0);
    state->volumes.back().linear = {};  // the source need not outlive `create`
    std::copy(source.labels.begin(), source.labels.end(),
              reinterpret_cast<Label*>(base + descriptor.off_labels));
    std::memcpy(base + header.off_volume_table + i * sizeof descriptor, &descriptor,
                sizeof descriptor);
  }
  std::copy(spec.scene_json.begin(), spec.scene_json.end(),
            reinterpret_cast<char*>(base + header.off_scene));
  state->ticks = tick_rings(base, header);
  state->boxes = {.slots = base + header.off_dirty,
                  .head = base + offsetof(SegmentHeader, dirty_head),
                  .mask = header.dirty_slots - 1};

  header.epoch = stable_version(0);
  header.heartbeat_ns = state->last_end_ns;
  std::memcpy(base, &header, sizeof header);
  words::word(base).store(kSegmentMagic, std::memory_order_release);
  state->header = header;
  state->memory.seal();
  return SegmentWriter(std::move(state));
}

SegmentWriter::SegmentWriter(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
SegmentWriter::SegmentWriter(SegmentWriter&&) noexcept = default;
SegmentWriter& SegmentWriter::operator=(SegmentWriter&&) noexcept = default;
SegmentWriter::~SegmentWriter() = default;

int SegmentWriter::fd() const noexcept {
  return state_->memory.fd();
}
std::uint64_t SegmentWriter::session_id() const noexcept {
  return state_->header.session_id;
}
std::uint64_t SegmentWriter::total_bytes() const noexcept {
  return state_->header.total_bytes;
}
bool SegmentWriter::locked() const noexcept {
  return state_->memory.locked();
}
std::uint32_t SegmentWriter::waiting_bricks() const noexcept {
  return state_->waiting();
}

void SegmentWriter::begin_tick(Tick tick) noexcept {
  state_->tick = std::max(tick, state_->tick + 1);
}

std::uint64_t changed_box_hash(const BrickGrid& bricks, std::span<const Density> linear,
                               const VoxelBox& box) noexcept {
  return bricks.touched_by(box) <= kMaxBricksPerTick ? box_hash(linear, bricks.grid, box) : 0;
}

std::uint64_t SegmentWriter::publish_box(std::size_t volume, std::span<const Density> linear,
                                         const VoxelBox& changed, std::uint32_t removed,
                                         DirtyCause cause) noexcept {
  State& state = *state_;
  assert(volume < state.volumes.size() && state.mirror_updates);
  if (volume >= state.volumes.size() || !state.mirror_updates) return 0;
  MirroredVolume& mirrored = state.volumes[volume];
  assert(linear.size() == mirrored.bricks.grid.voxel_count());
  const VoxelBox box = changed.clipped(mirrored.bricks.grid.box());
  if (box.empty() || linear.size() != mirrored.bricks.grid.voxel_count()) return 0;
  mirrored.linear = linear;
  mirrored.dirty.mark(box);

  DirtyRecord record{};
  record.tick = state.tick;
  record.time_ns = state.last_end_ns;
  const auto store = [](std::uint16_t(&to)[3], VoxelIndex from) {
    to[0] = static_cast<std::uint16_t>(from.x);
    to[1] = static_cast<std::uint16_t>(from.y);
    to[2] = static_cast<std::uint16_t>(from.z);
  };
  store(record.lo, box.lo);
  store(record.hi, box.hi);
  record.removed = removed;
  record.volume = static_cast<std::uint16_t>(volume);
  record.cause = static_cast<std::uint16_t>(cause);
  record.bricks = mirrored.bricks.touched_by(box);
  record.box_hash = changed_box_hash(mirrored.bricks, linear, box);
  state.boxes.push(record);
  return record.box_hash;
}

void SegmentWriter::publish_state(const TickRecord& record, std::size_t arm) noexcept {
  State& state = *state_;
  assert(arm < kMaxArms && state.ticks[arm].slots != nullptr);
  if (arm >= kMaxArms || state.ticks[arm].slots == nullptr) return;
  TickRecord out = record;
  out.crc32c = tick_record_crc(out);
  state.ticks[arm].push(out);
}

void SegmentWriter::end_tick(std::uint64_t now_ns) noexcept {
  State& state = *state_;
  std::byte* const epoch = state.hot(offsetof(SegmentHeader, epoch));
  std::uint32_t waiting = state.waiting();
  if (waiting != 0) {
    words::open(epoch, writing_version(state.tick));
    std::uint32_t budget = kMaxBricksPerTick;
    for (std::size_t i = 0; i < state.volumes.size(); ++i) {
      MirroredVolume& volume = state.volumes[(state.first_volume + i) % state.volumes.size()];
      budget -= volume.dirty.take(budget, [&](std::uint32_t id, const VoxelBox& changed) {
        volume.copy(id, changed, state.tick);
      });
    }
    state.first_volume = (state.first_volume + 1) % state.volumes.size();
    waiting = state.waiting();
  }
  if (waiting == 0) words::close(epoch, stable_version(state.tick));
  words::word(state.hot(offsetof(SegmentHeader, heartbeat_ns)))
      .store(now_ns, std::memory_order_relaxed);
  state.last_end_ns = now_ns;
}

void SegmentWriter::set_lifecycle(Lifecycle lifecycle) noexcept {
  words::word<std::uint32_t>(state_->hot(offsetof(SegmentHeader, lifecycle)))
      .store(static_cast<std::uint32_t>(lifecycle), std::memory_order_release);
}

}  // namespace kerf
