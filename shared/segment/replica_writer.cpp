// SPDX-License-Identifier: Apache-2.0

#include "shared/segment/replica_writer.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <utility>

#include "shared/segment/segment.hpp"
#include "shared/segment/seqlock.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace words = shared_words;

void require_place(bool holds, const char* what, std::uint64_t value) {
  if (holds) return;
  throw SegmentError("mirror: " + std::string(what) + " = " + std::to_string(value) +
                     "; the segment has no such place");
}

}  // namespace

ReplicaWriter ReplicaWriter::create(const MirrorSpec& spec) {
  SegmentPlan plan;
  plan.header.session_id = spec.session_id;
  plan.header.config_hash = spec.config_hash;
  plan.header.start_ns = spec.start_ns;
  plan.header.tick_ns = spec.tick_ns;
  plan.header.scene_bytes = spec.scene_bytes;
  plan.header.dirty_slots = kDirtySlots;
  set_build_id(plan.header, spec.build_id);
  require_place(spec.arms >= 1 && spec.arms <= kMaxArms, "arms", spec.arms);
  plan.header.off_state_2 = spec.arms == 2 ? 1 : 0;  // until `lay_out` places it
  plan.volumes = spec.volumes;
  lay_out(plan);
  check_plan(plan);
  if (plan.header.total_bytes > spec.most_bytes) {
    throw SegmentError("mirror: segment of " + std::to_string(plan.header.total_bytes >> 20) +
                       " MiB is above " + std::to_string(spec.most_bytes >> 20) +
                       " MiB; allow more or crop the volume");
  }
  ReplicaWriter out(SegmentMemory::create(plan.header.total_bytes));
  out.header_ = plan.header;
  out.volumes_ = std::move(plan.volumes);
  out.header_.epoch = writing_version(0);
  std::copy(out.volumes_.begin(), out.volumes_.end(),
            reinterpret_cast<VolumeDescriptor*>(out.at(out.header_.off_volume_table)));
  out.ticks_ = tick_rings(out.at(0), out.header_);
  out.boxes_ = {.slots = out.at(out.header_.off_dirty),
                .head = out.at(offsetof(SegmentHeader, dirty_head)),
                .mask = out.header_.dirty_slots - 1};
  std::memcpy(out.at(0), &out.header_, sizeof out.header_);
  words::word(out.at(0)).store(kSegmentMagic, std::memory_order_release);
  out.memory_.seal();
  return out;
}

BrickGrid ReplicaWriter::bricks_of(std::size_t volume, std::uint32_t brick) const {
  require_place(volume < volumes_.size(), "volume", volume);
  const VolumeDescriptor& descriptor = volumes_[volume];
  require_place(brick < descriptor.brick_count, "brick", brick);
  return BrickGrid::of({descriptor.nx, descriptor.ny, descriptor.nz});
}

void ReplicaWriter::put_scene(std::uint64_t offset, std::span<const std::byte> text) {
  require_place(offset <= header_.scene_bytes && text.size() <= header_.scene_bytes - offset,
                "scene text at", offset);
  std::copy(text.begin(), text.end(), at(header_.off_scene + offset));
}

void ReplicaWriter::put_labels(std::size_t volume, std::uint32_t brick,
                               std::span<const std::byte> labels) {
  const BrickGrid bricks = bricks_of(volume, brick);
  const std::uint64_t first = volumes_[volume].off_labels;
  require_place(first != 0 && labels.size() == kBrickVoxels * sizeof(Label), "labels of brick",
                brick);
  const VoxelBox box = bricks.voxels(brick);
  const auto width = static_cast<std::size_t>(box.hi.x - box.lo.x);
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const std::byte* const row =
          labels.data() + brick_row(y - box.lo.y, z - box.lo.z) * kBrickEdge;
      std::copy_n(row, width, at(first + bricks.grid.index(box.lo.x, y, z)));
    }
  }
}

void ReplicaWriter::begin_pass(Tick tick) noexcept {
  words::open(at(offsetof(SegmentHeader, epoch)), writing_version(tick));
}

void ReplicaWriter::put_brick(std::size_t volume, std::uint32_t brick, std::uint64_t version,
                              std::span<const std::byte> densities) {
  static_cast<void>(bricks_of(volume, brick));
  constexpr std::size_t kBytes = kBrickVoxels * sizeof(Density);
  require_place(densities.size() == kBytes && version % 2 == 0 && version != 0, "brick's version",
                version);
  const VolumeDescriptor& descriptor = volumes_[volume];
  std::byte* const word = at(descriptor.off_versions + std::size_t{brick} * sizeof version);
  words::open(word, version - 1);
  words::store(at(descriptor.off_bricks + brick * kBytes), densities.data(), kBytes);
  words::close(word, version);
}

void ReplicaWriter::end_pass(Tick tick) noexcept {
  words::close(at(offsetof(SegmentHeader, epoch)), stable_version(tick));
}

void ReplicaWriter::put_record(std::uint64_t index, const TickRecord& record,
                               std::size_t arm) noexcept {
  if (arm >= kMaxArms || ticks_[arm].slots == nullptr || index < ticks_[arm].published) return;
  TickRecord out = record;
  out.crc32c = tick_record_crc(out);
  ticks_[arm].skip_to(index);
  ticks_[arm].push(out);
}

void ReplicaWriter::put_record(std::uint64_t index, const DirtyRecord& record) noexcept {
  if (index < boxes_.published) return;
  boxes_.skip_to(index);
  boxes_.push(record);
}

void ReplicaWriter::beat(std::uint64_t heartbeat_ns) noexcept {
  words::word(at(offsetof(SegmentHeader, heartbeat_ns)))
      .store(heartbeat_ns, std::memory_order_relaxed);
}

void ReplicaWriter::set_lifecycle(Lifecycle lifecycle) noexcept {
  words::word<std::uint32_t>(at(offsetof(SegmentHeader, lifecycle)))
      .store(static_cast<std::uint32_t>(lifecycle), std::memory_order_release);
}

}  // namespace kerf
