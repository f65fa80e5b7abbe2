// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {

/// One field of one record. The stated part is what `kAbiHash` covers and the recorder writes; the
/// actual part is the compiler's.
struct LayoutField {
  std::string_view record;
  std::string_view name;
  std::uint32_t offset;
  std::string_view type;  ///< u8 u16 u32 u64 i16 i32 i64 f32 f64 char
  std::uint32_t count;    ///< elements; 1 for a scalar
  std::uint32_t actual_offset;
  std::uint32_t actual_bytes;
  std::string_view actual_type;
};

namespace layout_detail {

template <class T>
[[nodiscard]] constexpr std::string_view type_text() noexcept {
  using E = std::remove_all_extents_t<T>;
  if constexpr (std::is_same_v<E, char>) return "char";
  if constexpr (std::is_same_v<E, std::uint8_t>) return "u8";
  if constexpr (std::is_same_v<E, std::uint16_t>) return "u16";
  if constexpr (std::is_same_v<E, std::uint32_t>) return "u32";
  if constexpr (std::is_same_v<E, std::uint64_t>) return "u64";
  if constexpr (std::is_same_v<E, std::int16_t>) return "i16";
  if constexpr (std::is_same_v<E, std::int32_t>) return "i32";
  if constexpr (std::is_same_v<E, std::int64_t>) return "i64";
  if constexpr (std::is_same_v<E, float>) return "f32";
  if constexpr (std::is_same_v<E, double>) return "f64";
  return "?";
}

}  // namespace layout_detail

/// Bytes of one element of type `type`, e.g. "u32"; 0 if it is unknown.
[[nodiscard]] constexpr std::uint32_t type_bytes(std::string_view type) noexcept {
  if (type == "char" || type == "u8") return 1;
  if (type == "u16" || type == "i16") return 2;
  if (type == "u32" || type == "i32" || type == "f32") return 4;
  if (type == "u64" || type == "i64" || type == "f64") return 8;
  return 0;
}

// The stated numbers are the contract. The assertions below compare them with the compiler's. Only
// a macro can pass a field's name to offsetof.
// clang-format off
#define KERF_FIELD(RECORD, NAME, OFFSET, TYPE, COUNT)                                  \
  LayoutField{#RECORD, #NAME, OFFSET, TYPE, COUNT, offsetof(RECORD, NAME),             \
              sizeof(RECORD::NAME), layout_detail::type_text<decltype(RECORD::NAME)>()}
// clang-format on

/// Every field of every record, in order, without holes. Offsets are fixed here and nowhere else.
inline constexpr std::array kLayoutTable = {
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

    KERF_FIELD(TickRecord, seq, 0, "u64", 1),
    KERF_FIELD(TickRecord, tick, 8, "u64", 1),
    KERF_FIELD(TickRecord, start_ns, 16, "u64", 1),
    KERF_FIELD(TickRecord, period_error_ns, 24, "i32", 1),
    KERF_FIELD(TickRecord, execution_ns, 28, "u32", 1),
    KERF_FIELD(TickRecord, flags, 32, "u32", 1),
    KERF_FIELD(TickRecord, missed_deadlines, 36, "u32", 1),
    KERF_FIELD(TickRecord, encoder_counts, 40, "i32", 6),
    KERF_FIELD(TickRecord, position_mm, 64, "f64", 3),
    KERF_FIELD(TickRecord, orientation, 88, "f32", 4),
    KERF_FIELD(TickRecord, velocity_mm_per_s, 104, "f32", 3),
    KERF_FIELD(TickRecord, commanded_force_n, 116, "f32", 3),
    KERF_FIELD(TickRecord, contact_force_n, 128, "f32", 3),
    KERF_FIELD(TickRecord, modification_force_n, 140, "f32", 3),
    KERF_FIELD(TickRecord, proxy_offset_mm, 152, "f32", 3),
    KERF_FIELD(TickRecord, dac_counts, 164, "i16", 3),
    KERF_FIELD(TickRecord, phase, 170, "u16", 1),
    KERF_FIELD(TickRecord, removed, 172, "u32", 1),
    KERF_FIELD(TickRecord, port_energy_j, 176, "f64", 1),
    KERF_FIELD(TickRecord, port_minimum_j, 184, "f64", 1),
    KERF_FIELD(TickRecord, joint_torque_n_mm, 192, "f32", 3),
    KERF_FIELD(TickRecord, refused_packets, 204, "u32", 1),
    KERF_FIELD(TickRecord, volume_hash, 208, "u64", 1),
    KERF_FIELD(TickRecord, output_hash, 216, "u64", 1),
    KERF_FIELD(TickRecord, dirty_lo, 224, "u16", 3),
    KERF_FIELD(TickRecord, dirty_hi, 230, "u16", 3),
    KERF_FIELD(TickRecord, lost_packets, 236, "u32", 1),
    KERF_FIELD(TickRecord, dirty_volumes, 240, "u32", 1),
    KERF_FIELD(TickRecord, last_command, 244, "u32", 1),
    KERF_FIELD(TickRecord, tip_torque_n_mm, 248, "f32", 3),
    KERF_FIELD(TickRecord, spindle_ratio, 260, "f32", 1),
    KERF_FIELD(TickRecord, raw, 264, "i32", 11),
    KERF_FIELD(TickRecord, press_n, 308, "f32", 1),
    KERF_FIELD(TickRecord, energy_spring, 312, "i64", 1),
    KERF_FIELD(TickRecord, energy_damping, 320, "i64", 1),
    KERF_FIELD(TickRecord, energy_friction, 328, "i64", 1),
    KERF_FIELD(TickRecord, energy_cutting, 336, "i64", 1),
    KERF_FIELD(TickRecord, energy_limits, 344, "i64", 1),
    KERF_FIELD(TickRecord, energy_hold, 352, "i64", 1),
    KERF_FIELD(TickRecord, energy_leak, 360, "i64", 1),
    KERF_FIELD(TickRecord, energy_stabiliser, 368, "i64", 1),
    KERF_FIELD(TickRecord, spindle_load, 376, "f32", 1),
    KERF_FIELD(TickRecord, active_tool, 380, "u32", 1),
    KERF_FIELD(TickRecord, fault, 384, "u32", 1),
    KERF_FIELD(TickRecord, stale, 388, "u32", 1),
    KERF_FIELD(TickRecord, penetration_mm, 392, "f32", 1),
    KERF_FIELD(TickRecord, plane_count, 396, "u32", 1),
    KERF_FIELD(TickRecord, plane_load_n, 400, "f32", 3),
    KERF_FIELD(TickRecord, plane_normal, 412, "f32", 9),
    KERF_FIELD(TickRecord, plane_arm_mm, 448, "f32", 9),
    KERF_FIELD(TickRecord, command, 484, "u32", 1),
    KERF_FIELD(TickRecord, command_argument, 488, "u32", 1),
    KERF_FIELD(TickRecord, crc32c, 492, "u32", 1),

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
#undef KERF_FIELD

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
