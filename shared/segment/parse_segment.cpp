// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "shared/segment/layout_table.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/seqlock.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {
namespace {

constexpr std::uint64_t kMaxRingSlots = 1U << 20;  // 17 min at 1 kHz; no header may claim more

[[noreturn]] void refuse(const std::string& field, const std::string& value,
                         const std::string& expected) {
  throw SegmentError("segment: " + field + " = " + value + "; expected " + expected);
}

template <class Number>
void require(bool holds, const std::string& field, Number value, const std::string& expected) {
  if (!holds) refuse(field, std::to_string(value), expected);
}

/// True if `count` elements from `offset` on lie behind the header, aligned to 8 bytes, within
/// `total` bytes.
[[nodiscard]] bool inside(std::uint64_t offset, std::uint64_t count, std::uint64_t element_bytes,
                          std::uint64_t total) noexcept {
  if (offset < sizeof(SegmentHeader) || offset > total || offset % 8 != 0) return false;
  return count <= (total - offset) / element_bytes;
}

void check_header(const SegmentHeader& header, std::uint64_t bytes) {
  require(header.total_bytes == bytes, "total_bytes", header.total_bytes,
          std::to_string(bytes) + ", the size of the memory");
  require(header.tick_ns != 0, "tick_ns", header.tick_ns, "at least 1");
  require(header.volume_count >= 1 && header.volume_count <= kMaxVolumes, "volume_count",
          header.volume_count, "1 to " + std::to_string(kMaxVolumes));
  require(inside(header.off_volume_table, header.volume_count, sizeof(VolumeDescriptor), bytes),
          "off_volume_table", header.off_volume_table, "a table inside the memory");
  const auto check_ring = [bytes](const std::string& name, std::uint64_t offset,
                                  std::uint32_t slots, std::uint32_t record_bytes,
                                  std::uint64_t expected_bytes) {
    require(std::has_single_bit(slots) && slots <= kMaxRingSlots, name + "_slots", slots,
            "a power of two up to " + std::to_string(kMaxRingSlots));
    require(record_bytes == expected_bytes, name + "_record_bytes", record_bytes,
            std::to_string(expected_bytes));
    require(inside(offset, slots, expected_bytes, bytes), "off_" + name, offset,
            "a ring inside the memory");
  };
  check_ring("state", header.off_state, header.state_slots, header.state_record_bytes,
             sizeof(TickRecord));
  if (header.off_state_2 != 0) {
    require(inside(header.off_state_2, header.state_slots, sizeof(TickRecord), bytes),
            "off_state_2", header.off_state_2, "0 or a ring inside the memory");
  }
  check_ring("dirty", header.off_dirty, header.dirty_slots, header.dirty_record_bytes,
             sizeof(DirtyRecord));
  require(header.scene_bytes <= kMaxSceneBytes, "scene_bytes", header.scene_bytes,
          "at most " + std::to_string(kMaxSceneBytes));
  require(inside(header.off_scene, header.scene_bytes, 1, bytes), "off_scene", header.off_scene,
          "a text inside the memory");
}

SegmentVolumeInfo check_volume(const VolumeDescriptor& in, std::size_t index, std::uint64_t bytes) {
  const std::string location = "volume " + std::to_string(index) + " ";
  SegmentVolumeInfo out;
  out.grid = {in.nx, in.ny, in.nz};
  const std::uint64_t voxels = std::uint64_t{in.nx} * in.ny * in.nz;
  require(voxels != 0, location + "extent", voxels, "at least one voxel");
  require(in.log2_brick == kBrickLog2, location + "log2_brick", int{in.log2_brick},
          std::to_string(kBrickLog2));
  require(in.bits_per_voxel == 8 * sizeof(Density), location + "bits_per_voxel",
          int{in.bits_per_voxel}, std::to_string(8 * sizeof(Density)));
  out.bricks = BrickGrid::of(out.grid);
  const auto axis = [](std::int32_t n) { return static_cast<std::uint32_t>(n); };
  require(in.bricks_x == axis(out.bricks.bx), location + "bricks_x", in.bricks_x,
          std::to_string(out.bricks.bx));
  require(in.bricks_y == axis(out.bricks.by), location + "bricks_y", in.bricks_y,
          std::to_string(out.bricks.by));
  require(in.bricks_z == axis(out.bricks.bz), location + "bricks_z", in.bricks_z,
          std::to_string(out.bricks.bz));
  const std::uint64_t count = std::uint64_t{in.bricks_x} * in.bricks_y * in.bricks_z;
  require(count <= kMaxBricks, location + "bricks", count, "at most " + std::to_string(kMaxBricks));
  require(in.brick_count == count, location + "brick_count", in.brick_count, std::to_string(count));
  require(inside(in.off_versions, count, sizeof(std::uint64_t), bytes), location + "off_versions",
          in.off_versions, "an array inside the memory");
  require(inside(in.off_bricks, count, kBrickVoxels * sizeof(Density), bytes),
          location + "off_bricks", in.off_bricks, "an array inside the memory");
  require(in.off_labels == 0 || inside(in.off_labels, voxels, sizeof(Label), bytes),
          location + "off_labels", in.off_labels, "0 or an array inside the memory");
  float length2 = 0;
  for (const float part : in.orientation) length2 += part * part;
  require(std::abs(length2 - 1) < 1e-3F, location + "orientation squared", length2, "1");
  for (std::size_t k = 0; k < 3; ++k) {
    require(std::isfinite(in.spacing_mm[k]) && in.spacing_mm[k] > 0, location + "spacing_mm",
            in.spacing_mm[k], "a positive number");
    require(std::isfinite(in.origin_mm[k]), location + "origin_mm", in.origin_mm[k], "a number");
  }
  std::copy_n(in.spacing_mm, 3, out.spacing_mm.begin());
  std::copy_n(in.origin_mm, 3, out.origin_mm.begin());
  std::copy_n(in.orientation, 4, out.orientation.begin());
  out.material = in.material;
  out.iso = in.iso;
  out.has_labels = in.off_labels != 0;
  out.initial_hash = in.initial_hash;
  out.off_versions = in.off_versions;
  out.off_bricks = in.off_bricks;
  out.off_labels = in.off_labels;
  return out;
}

}  // namespace

void require_same_layout(std::uint32_t major, std::uint32_t minor, std::uint64_t abi_hash) {
  if (major != kLayoutMajor || minor != kLayoutMinor) {
    const auto text = [](std::uint32_t a, std::uint32_t b) {
      return std::to_string(a) + "." + std::to_string(b);
    };
    refuse("layout version", text(major, minor),
           text(kLayoutMajor, kLayoutMinor) + ": use programs of one build");
  }
  if (abi_hash != kAbiHash) {
    refuse("abi hash", hex64(abi_hash), hex64(kAbiHash) + ": use programs of one build");
  }
}

void check_plan(const SegmentPlan& plan) {
  check_header(plan.header, plan.header.total_bytes);
  for (std::size_t i = 0; i < plan.volumes.size(); ++i) {
    static_cast<void>(check_volume(plan.volumes[i], i, plan.header.total_bytes));
  }
}

SegmentInfo parse_segment(std::span<std::byte> segment) {
  if (segment.size() < sizeof(SegmentHeader)) {
    refuse("size", std::to_string(segment.size()), "at least one page of header");
  }
  const std::uint64_t magic = shared_words::word(segment.data()).load(std::memory_order_acquire);
  if (magic != kSegmentMagic) refuse("magic", hex64(magic), hex64(kSegmentMagic));
  SegmentHeader header{};
  std::memcpy(&header, segment.data(), kStaticHeaderBytes);
  require_same_layout(header.layout_major, header.layout_minor, header.abi_hash);
  check_header(header, segment.size());

  SegmentInfo info;
  info.session_id = header.session_id;
  info.config_hash = header.config_hash;
  info.start_ns = header.start_ns;
  info.total_bytes = header.total_bytes;
  info.tick_ns = header.tick_ns;
  info.arms = header.off_state_2 == 0 ? 1 : 2;
  info.off_state = {header.off_state, header.off_state_2};
  info.off_dirty = header.off_dirty;
  info.state_slots = header.state_slots;
  info.dirty_slots = header.dirty_slots;
  info.build_id.assign(header.build_id, strnlen(header.build_id, sizeof header.build_id));
  info.scene_json.assign(reinterpret_cast<const char*>(segment.data() + header.off_scene),
                         static_cast<std::size_t>(header.scene_bytes));
  for (std::size_t i = 0; i < header.volume_count; ++i) {
    VolumeDescriptor descriptor{};
    std::memcpy(&descriptor, segment.data() + header.off_volume_table + i * sizeof descriptor,
                sizeof descriptor);
    info.volumes.push_back(check_volume(descriptor, i, segment.size()));
  }
  return info;
}

}  // namespace kerf
