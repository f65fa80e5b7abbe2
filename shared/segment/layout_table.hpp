// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>

#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/layout_field.hpp"
#include "shared/segment/tick_table.hpp"

namespace kerf {

namespace layout_detail {

inline constexpr std::array kBeforeTicks = {
    KERF_FIELD(SegmentHeader, magic, 0x000, "u64", 1),
    KERF_FIELD(SegmentHeader, layout_major, 0x008, "u32", 1),
    KERF_FIELD(SegmentHeader, layout_minor, 0x00c, "u32", 1),
    KERF_FIELD(SegmentHeader, abi_hash, 0x010, "u64", 1),
    KERF_FIELD(SegmentHeader, session_id, 0x018, "u64", 1),
    KERF_FIELD(SegmentHeader, total_bytes, 0x020, "u64", 1),
    KERF_FIELD(SegmentHeader, config_hash, 0x028, "u64", 1),
    KERF_FIELD(SegmentHeader, start_ns, 0x030, "u64", 1),
    KERF_FIELD(SegmentHeader, tick_ns, 0x038, "u32", 1),
    KERF_FIELD(SegmentHeader, volume_count, 0x03c, "u32", 1),
    KERF_FIELD(SegmentHeader, off_state, 0x040, "u64", 1),
    KERF_FIELD(SegmentHeader, off_dirty, 0x048, "u64", 1),
    KERF_FIELD(SegmentHeader, off_volume_table, 0x050, "u64", 1),
    KERF_FIELD(SegmentHeader, state_slots, 0x058, "u32", 1),
    KERF_FIELD(SegmentHeader, dirty_slots, 0x05c, "u32", 1),
    KERF_FIELD(SegmentHeader, state_record_bytes, 0x060, "u32", 1),
    KERF_FIELD(SegmentHeader, dirty_record_bytes, 0x064, "u32", 1),
    KERF_FIELD(SegmentHeader, off_scene, 0x068, "u64", 1),
    KERF_FIELD(SegmentHeader, scene_bytes, 0x070, "u64", 1),
    KERF_FIELD(SegmentHeader, off_state_2, 0x078, "u64", 1),
    KERF_FIELD(SegmentHeader, build_id, 0x080, "char", 64),
    KERF_FIELD(SegmentHeader, reserved1, 0x0c0, "u64", 8),
    KERF_FIELD(SegmentHeader, state_head, 0x100, "u64", 1),
    KERF_FIELD(SegmentHeader, pad_state, 0x108, "u64", 7),
    KERF_FIELD(SegmentHeader, dirty_head, 0x140, "u64", 1),
    KERF_FIELD(SegmentHeader, pad_dirty, 0x148, "u64", 7),
    KERF_FIELD(SegmentHeader, epoch, 0x180, "u64", 1),
    KERF_FIELD(SegmentHeader, pad_epoch, 0x188, "u64", 7),
    KERF_FIELD(SegmentHeader, heartbeat_ns, 0x1c0, "u64", 1),
    KERF_FIELD(SegmentHeader, lifecycle, 0x1c8, "u32", 1),
    KERF_FIELD(SegmentHeader, pad_life, 0x1cc, "u32", 1),
    KERF_FIELD(SegmentHeader, pad_heartbeat, 0x1d0, "u64", 6),
    KERF_FIELD(SegmentHeader, state_head_2, 0x200, "u64", 1),
    KERF_FIELD(SegmentHeader, pad_state_2, 0x208, "u64", 7),
    KERF_FIELD(SegmentHeader, pad_page, 0x240, "u64", 440),

    KERF_FIELD(VolumeDescriptor, nx, 0, "u16", 1),
    KERF_FIELD(VolumeDescriptor, ny, 2, "u16", 1),
    KERF_FIELD(VolumeDescriptor, nz, 4, "u16", 1),
    KERF_FIELD(VolumeDescriptor, log2_brick, 6, "u8", 1),
    KERF_FIELD(VolumeDescriptor, bits_per_voxel, 7, "u8", 1),
    KERF_FIELD(VolumeDescriptor, bricks_x, 8, "u32", 1),
    KERF_FIELD(VolumeDescriptor, bricks_y, 12, "u32", 1),
    KERF_FIELD(VolumeDescriptor, bricks_z, 16, "u32", 1),
    KERF_FIELD(VolumeDescriptor, brick_count, 20, "u32", 1),
    KERF_FIELD(VolumeDescriptor, spacing_mm, 24, "f64", 3),
    KERF_FIELD(VolumeDescriptor, origin_mm, 48, "f64", 3),
    KERF_FIELD(VolumeDescriptor, off_versions, 72, "u64", 1),
    KERF_FIELD(VolumeDescriptor, off_bricks, 80, "u64", 1),
    KERF_FIELD(VolumeDescriptor, initial_hash, 88, "u64", 1),
    KERF_FIELD(VolumeDescriptor, material, 96, "u32", 1),
    KERF_FIELD(VolumeDescriptor, iso, 100, "u32", 1),
    KERF_FIELD(VolumeDescriptor, orientation, 104, "f32", 4),
    KERF_FIELD(VolumeDescriptor, off_labels, 120, "u64", 1),
};

inline constexpr std::array kBehindTicks = {
    KERF_FIELD(DirtyRecord, seq, 0, "u64", 1),
    KERF_FIELD(DirtyRecord, tick, 8, "u64", 1),
    KERF_FIELD(DirtyRecord, time_ns, 16, "u64", 1),
    KERF_FIELD(DirtyRecord, lo, 24, "u16", 3),
    KERF_FIELD(DirtyRecord, hi, 30, "u16", 3),
    KERF_FIELD(DirtyRecord, removed, 36, "u32", 1),
    KERF_FIELD(DirtyRecord, volume, 40, "u16", 1),
    KERF_FIELD(DirtyRecord, cause, 42, "u16", 1),
    KERF_FIELD(DirtyRecord, bricks, 44, "u32", 1),
    KERF_FIELD(DirtyRecord, box_hash, 48, "u64", 1),
    KERF_FIELD(DirtyRecord, reserved0, 56, "u64", 1),
};

}  // namespace layout_detail

/// Every field of every record, in order, without holes; those of a tick by tick_table.hpp. Offsets
/// are fixed in these tables and nowhere else.
inline constexpr auto kLayoutTable = [] {
  using namespace layout_detail;
  std::array<LayoutField, kBeforeTicks.size() + std::size(kTickFields) + kBehindTicks.size()> all{};
  auto* to = std::copy(kBeforeTicks.begin(), kBeforeTicks.end(), all.begin());
  to = std::transform(std::begin(kTickFields), std::end(kTickFields), to,
                      [](const TickField& field) { return field.layout; });
  std::copy(kBehindTicks.begin(), kBehindTicks.end(), to);
  return all;
}();

/// True if the stated rows of `record` match the compiler's layout, without holes, `bytes` in all.
[[nodiscard]] constexpr bool layout_matches(std::string_view record, std::size_t bytes) noexcept {
  std::uint32_t next = 0;
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != record) continue;
    if (field.offset != next || field.offset != field.actual_offset) return false;
    if (field.type != field.actual_type) return false;
    if (field.actual_bytes != type_bytes(field.type) * field.count) return false;
    next += field.actual_bytes;
  }
  return next == bytes;
}
static_assert(layout_matches("SegmentHeader", 4096) && sizeof(SegmentHeader) == 4096);
static_assert(layout_matches("VolumeDescriptor", 128) && sizeof(VolumeDescriptor) == 128);
static_assert(layout_matches("TickRecord", 496) && sizeof(TickRecord) == 496);
static_assert(layout_matches("DirtyRecord", 64) && sizeof(DirtyRecord) == 64);
static_assert(kStaticHeaderBytes == 0x100);

/// FNV-1a over the text "record.name:offset:type[count];" of every row.
inline constexpr std::uint64_t kAbiHash = [] {
  std::uint64_t hash = kFnv1aBasis;
  const auto add = [&hash](std::string_view text) { hash = fnv1a(text, hash); };
  const auto add_number = [&add](std::uint32_t number) {
    char digits[10] = {};
    std::size_t first = sizeof digits;
    do {
      digits[--first] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number != 0);
    add({digits + first, sizeof digits - first});
  };
  for (const LayoutField& field : kLayoutTable) {
    add(field.record), add("."), add(field.name), add(":"), add_number(field.offset);
    add(":"), add(field.type), add("["), add_number(field.count), add("];");
  }
  return hash;
}();

}  // namespace kerf
