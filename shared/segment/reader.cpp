// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/reader.hpp"

#include <array>
#include <atomic>
#include <cstring>
#include <utility>

#include "shared/segment/seqlock.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace words = shared_words;

constexpr int kMaxTries = 64;  // to copy one brick or record
constexpr int kMaxPasses = 4;  // over the versions in one update; 2 is the most seen so far

using Brick = std::array<Density, kBrickVoxels>;

/// Copies a brick and returns its version; 0 if no try gave a consistent copy.
[[nodiscard]] std::uint64_t copy_brick(std::byte* version, std::byte* content,
                                       std::span<Density, kBrickVoxels> brick) noexcept {
  for (int i = 0; i < kMaxTries; ++i) {
    const std::uint64_t seen = words::word(version).load(std::memory_order_acquire);
    if (seen % 2 != 0) continue;
    words::load(brick.data(), content, brick.size_bytes());
    if (words::unchanged(version, seen)) return seen;
  }
  return 0;
}

/// Copies a brick into the volume `linear`; returns the voxels whose density changed.
VoxelMask place_brick(const Brick& brick, const VoxelBox& box, const VoxelGrid& grid,
                      std::span<Density> linear) {
  VoxelMask changed{};
  const std::int32_t width = box.hi.x - box.lo.x;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      Density* const to = linear.data() + grid.index(box.lo.x, y, z);
      const Density* const from = brick.data() + brick_row(y - box.lo.y, z - box.lo.z) * kBrickEdge;
      changed[static_cast<std::size_t>(z - box.lo.z)] |= differing(to, from, width)
                                                         << 8 * (y - box.lo.y);
      copy_row(to, from, static_cast<std::size_t>(width));
    }
  }
  return changed;
}

}  // namespace

SegmentReader::SegmentReader(std::span<std::byte> bytes, SegmentInfo info) noexcept
    : bytes_(bytes), info_(std::move(info)) {}

SegmentReader::SegmentReader(SegmentReader&& other) noexcept
    : bytes_(std::exchange(other.bytes_, {})), info_(std::move(other.info_)) {}

SegmentReader& SegmentReader::operator=(SegmentReader&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  std::swap(info_, other.info_);
  return *this;
}

std::uint64_t SegmentReader::state_head(std::size_t arm) const noexcept {
  if (arm >= info_.arms) return 0;
  const std::size_t offset =
      arm == 0 ? offsetof(SegmentHeader, state_head) : offsetof(SegmentHeader, state_head_2);
  return words::word(bytes_.data() + offset).load(std::memory_order_acquire);
}

std::uint64_t SegmentReader::dirty_head() const noexcept {
  return words::word(bytes_.data() + offsetof(SegmentHeader, dirty_head))
      .load(std::memory_order_acquire);
}

std::uint64_t SegmentReader::heartbeat_ns() const noexcept {
  return words::word(bytes_.data() + offsetof(SegmentHeader, heartbeat_ns))
      .load(std::memory_order_relaxed);
}

Lifecycle SegmentReader::lifecycle() const noexcept {
  const auto value = words::word<std::uint32_t>(bytes_.data() + offsetof(SegmentHeader, lifecycle))
                         .load(std::memory_order_acquire);
  return value <= static_cast<std::uint32_t>(Lifecycle::fault) ? static_cast<Lifecycle>(value)
                                                               : Lifecycle::fault;
}

template <class Record>
ReadState SegmentReader::record_at(std::uint64_t offset, std::uint32_t slots, std::uint64_t head,
                                   std::uint64_t index, Record& out) const noexcept {
  if (index >= head) return ReadState::not_yet;
  if (head - index > slots) return ReadState::overrun;
  std::byte* const slot = bytes_.data() + offset + (index & (slots - 1)) * sizeof(Record);
  const std::uint64_t expected = 2 * index + 2;
  for (int i = 0; i < kMaxTries; ++i) {
    const std::uint64_t seen = words::word(slot).load(std::memory_order_acquire);
    if (seen > expected) return ReadState::overrun;
    if (seen != expected) continue;
    Record copy;
    words::load(&copy, slot, sizeof copy);
    if (!words::unchanged(slot, seen)) continue;
    out = copy;
    return ReadState::ok;
  }
  return ReadState::busy;
}

ReadState SegmentReader::state_at(std::uint64_t index, TickRecord& out,
                                  std::size_t arm) const noexcept {
  if (arm >= info_.arms) return ReadState::not_yet;
  TickRecord record;
  const ReadState state =
      record_at(info_.off_state[arm], info_.state_slots, state_head(arm), index, record);
  if (state != ReadState::ok) return state;
  if (tick_record_crc(record) != record.crc32c) return ReadState::busy;
  out = record;
  return ReadState::ok;
}

ReadState SegmentReader::dirty_at(std::uint64_t index, DirtyRecord& out) const noexcept {
  return record_at(info_.off_dirty, info_.dirty_slots, dirty_head(), index, out);
}

std::optional<TickRecord> SegmentReader::latest(std::size_t arm) const noexcept {
  TickRecord record;
  for (int i = 0; i < kMaxTries; ++i) {
    const std::uint64_t head = state_head(arm);
    if (head == 0) return std::nullopt;
    if (state_at(head - 1, record, arm) == ReadState::ok) return record;
  }
  return std::nullopt;
}

std::optional<TickRecord> SegmentReader::second_of(const TickRecord& first) const noexcept {
  TickRecord record;
  if (state_at(record_index(first), record, 1) != ReadState::ok) return std::nullopt;
  return record;
}

std::span<const Label> SegmentReader::labels(std::size_t volume) const noexcept {
  if (volume >= info_.volumes.size() || !info_.volumes[volume].has_labels) return {};
  const SegmentVolumeInfo& info = info_.volumes[volume];
  return {reinterpret_cast<const Label*>(bytes_.data() + info.off_labels), info.grid.voxel_count()};
}

bool SegmentReader::copy_changed(const SegmentVolumeInfo& volume, VolumeSnapshot& snapshot) const {
  std::byte* const versions = bytes_.data() + volume.off_versions;
  std::byte* const content = bytes_.data() + volume.off_bricks;
  bool all = true;
  Brick brick;
  for (std::uint32_t id = 0; id < snapshot.versions.size(); ++id) {
    std::byte* const version = versions + std::size_t{id} * sizeof(std::uint64_t);
    if (words::word(version).load(words::kDataLoad) == snapshot.versions[id]) continue;
    const std::uint64_t whole =
        copy_brick(version, content + std::size_t{id} * sizeof brick, brick);
    if (whole == 0) {
      all = false;
      continue;
    }
    if (whole == snapshot.versions[id]) continue;
    snapshot.changed.add(
        {id, place_brick(brick, volume.bricks.voxels(id), volume.grid, snapshot.density)});
    snapshot.versions[id] = whole;
  }
  return all;
}

void SegmentReader::update(std::size_t volume, VolumeSnapshot& snapshot) const {
  const SegmentVolumeInfo& info = info_.volumes.at(volume);
  snapshot.changed.clear();
  snapshot.consistent = false;
  if (snapshot.session_id != info_.session_id || snapshot.versions.size() != info.bricks.count() ||
      snapshot.density.size() != info.grid.voxel_count()) {
    snapshot.session_id = info_.session_id;
    snapshot.versions.assign(info.bricks.count(), 0);
    snapshot.density.assign(info.grid.voxel_count(), 0);
  }
  for (int pass = 0; pass < kMaxPasses && !snapshot.consistent; ++pass) {
    const std::uint64_t before = epoch();
    const bool all = copy_changed(info, snapshot);
    snapshot.consistent = all && before % 2 == 0 && unchanged_since(before);
    if (snapshot.consistent) snapshot.tick = tick_of_version(before);
  }
}

std::uint64_t SegmentReader::epoch() const noexcept {
  return words::word(bytes_.data() + offsetof(SegmentHeader, epoch))
      .load(std::memory_order_acquire);
}

bool SegmentReader::unchanged_since(std::uint64_t seen) const noexcept {
  return words::unchanged(bytes_.data() + offsetof(SegmentHeader, epoch), seen);
}

void SegmentReader::changed_bricks(std::size_t volume, std::span<const std::uint64_t> seen,
                                   std::vector<std::uint32_t>& ids) const {
  std::byte* const versions = bytes_.data() + info_.volumes.at(volume).off_versions;
  for (std::uint32_t id = 0; id < seen.size(); ++id) {
    std::byte* const version = versions + std::size_t{id} * sizeof(std::uint64_t);
    if (words::word(version).load(words::kDataLoad) != seen[id]) ids.push_back(id);
  }
}

std::uint64_t SegmentReader::read_brick(std::size_t volume, std::uint32_t id,
                                        std::span<Density, kBrickVoxels> out) const noexcept {
  const SegmentVolumeInfo& info = info_.volumes[volume];
  return copy_brick(bytes_.data() + info.off_versions + std::size_t{id} * sizeof(std::uint64_t),
                    bytes_.data() + info.off_bricks + std::size_t{id} * sizeof(Brick), out);
}

}  // namespace kerf
