// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "include/kerf/tick.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/volume/checksum.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

// The shared memory segment, byte by byte. The controller writes it (on a second machine
// `kerf-bridge join` does, replica_writer.hpp); readers map it read-only.
//
//     0                 SegmentHeader, one page
//     off_volume_table  one VolumeDescriptor per volume
//     off_scene         canonical scene, JSON text
//     off_state         ring of TickRecord, slot = index mod state_slots
//     off_state_2       the same ring of the second arm; 0 if there is one arm
//     off_dirty         ring of DirtyRecord, slot = index mod dirty_slots
//     per volume        u64 version per brick | 512 densities per brick | labels (optional)
//
// Little-endian, natural alignment; byte offsets from the start instead of pointers.
// `layout_table.hpp` lists every field as (name, offset, type); the table is checked against these
// structs and hashed into `kAbiHash`, so a program built with another layout refuses the segment
// instead of misreading it.

static_assert(std::endian::native == std::endian::little,
              "the segment and the log are little-endian and written as they lie in memory; a "
              "big-endian machine runs the servo core only (KERF_CORE_ONLY)");

inline constexpr std::uint64_t kSegmentMagic = [] {
  std::uint64_t magic = 0;
  for (std::size_t i = 8; i-- > 0;) magic = magic << 8 | static_cast<unsigned char>("KERFSHM1"[i]);
  return magic;
}();
inline constexpr std::uint32_t kLayoutMajor = 1;
inline constexpr std::uint32_t kLayoutMinor = 4;
inline constexpr std::uint32_t kStateSlots = 4096;  // 4.1 s at 1 kHz: longest pause of a reader
inline constexpr std::uint32_t kDirtySlots = 4096;
inline constexpr std::uint64_t kMaxSceneBytes = std::uint64_t{1} << 26;  // readers copy all of it
inline constexpr std::uint32_t kMaxBricks = 1U << 21;  // per volume: 1024^3 voxels, 2 GiB

/// State of the run. Every value from `clean_end` on is final.
enum class Lifecycle : std::uint32_t { init = 0, run = 1, hold = 2, clean_end = 3, fault = 4 };

/// Version word of a brick, or of all volumes together (`SegmentHeader::epoch`): odd while tick `t`
/// is being written, even once it is complete. 0 means "no version yet", so tick 0 has version 2.
[[nodiscard]] constexpr std::uint64_t stable_version(Tick tick) noexcept {
  return 2 * tick + 2;
}
[[nodiscard]] constexpr std::uint64_t writing_version(Tick tick) noexcept {
  return 2 * tick + 1;
}
[[nodiscard]] constexpr Tick tick_of_version(std::uint64_t version) noexcept {
  return version < 2 ? 0 : version / 2 - 1;
}

/// Page 0. All fields before `state_head` are written once, before the magic. Each later field has
/// a 64-byte line of its own; `lifecycle` shares that of `heartbeat_ns`.
struct SegmentHeader {
  std::uint64_t magic;         ///< stored last (release), read first (acquire)
  std::uint32_t layout_major;  ///< `kLayoutMajor`; a reader refuses any other value
  std::uint32_t layout_minor;  ///< `kLayoutMinor`; a reader refuses any other value
  std::uint64_t abi_hash;      ///< `kAbiHash`, over the layout; a reader refuses any other value
  std::uint64_t session_id;    ///< random, not 0; each start of the controller has a new one
  std::uint64_t total_bytes;   ///< size of the segment
  std::uint64_t config_hash;   ///< of the scene with all its settings
  std::uint64_t start_ns;      ///< CLOCK_MONOTONIC when the segment was made; 0 in lock-step
  std::uint32_t tick_ns;       ///< period of the servo
  std::uint32_t volume_count;
  std::uint64_t off_state;
  std::uint64_t off_dirty;
  std::uint64_t off_volume_table;
  std::uint32_t state_slots;  ///< power of two
  std::uint32_t dirty_slots;  ///< power of two
  std::uint32_t state_record_bytes;
  std::uint32_t dirty_record_bytes;
  std::uint64_t off_scene;
  std::uint64_t scene_bytes;
  std::uint64_t off_state_2;  ///< ring of the second arm's tick records; 0 if there is one arm
  char build_id[64];          ///< for messages only, zero-terminated
  std::uint64_t reserved1[8];
  std::uint64_t state_head;  ///< tick records published so far
  std::uint64_t pad_state[7];
  std::uint64_t dirty_head;  ///< dirty records published so far
  std::uint64_t pad_dirty[7];
  std::uint64_t epoch;  ///< version word of all volumes together; odd while changed bricks wait
  std::uint64_t pad_epoch[7];
  std::uint64_t heartbeat_ns;  ///< CLOCK_MONOTONIC at the end of the last tick
  std::uint32_t lifecycle;
  std::uint32_t pad_life;
  std::uint64_t pad_heartbeat[6];
  std::uint64_t state_head_2;  ///< tick records of the second arm published so far
  std::uint64_t pad_state_2[7];
  std::uint64_t pad_page[440];
};
inline constexpr std::size_t kStaticHeaderBytes = offsetof(SegmentHeader, state_head);

/// One volume. `origin_mm` is the world position of the centre of voxel (0, 0, 0).
struct VolumeDescriptor {
  std::uint16_t nx, ny, nz;
  std::uint8_t log2_brick;
  std::uint8_t bits_per_voxel;
  std::uint32_t bricks_x, bricks_y, bricks_z;
  std::uint32_t brick_count;
  double spacing_mm[3];
  double origin_mm[3];
  std::uint64_t off_versions;
  std::uint64_t off_bricks;
  std::uint64_t initial_hash;  ///< `density_hash` of the content at tick 0
  std::uint32_t material;
  std::uint32_t iso;
  float orientation[4];      ///< quaternion x, y, z, w: voxel axes to world
  std::uint64_t off_labels;  ///< u8 per voxel, x fastest, constant; 0 if there are no labels
};

/// The index of a published record in its ring. With two arms, index i of both rings is the
/// same tick.
[[nodiscard]] inline std::uint64_t record_index(const TickRecord& record) noexcept {
  return record.seq / 2 - 1;
}

/// The checksum of a tick record: of all bytes between its sequence number and its checksum.
[[nodiscard]] inline std::uint32_t tick_record_crc(const TickRecord& record) noexcept {
  constexpr std::size_t kFirst = offsetof(TickRecord, tick);
  return crc32c(
      std::as_bytes(std::span(&record, 1)).subspan(kFirst, offsetof(TickRecord, crc32c) - kFirst));
}

/// Why a box of voxels changed.
enum class DirtyCause : std::uint16_t { milling = 0, load = 1, reset = 2, undo = 3, redo = 4 };

/// One changed box of voxels, as a hint and for the history. Readers do not need it to find changed
/// bricks: the version words are enough.
struct DirtyRecord {
  std::uint64_t seq;
  std::uint64_t tick;
  std::uint64_t time_ns;  ///< CLOCK_MONOTONIC at the end of the previous tick
  std::uint16_t lo[3];
  std::uint16_t hi[3];    ///< exclusive
  std::uint32_t removed;  ///< density units; by an undo: restored
  std::uint16_t volume;
  std::uint16_t cause;
  std::uint32_t bricks;    ///< number of bricks that the box touches
  std::uint64_t box_hash;  ///< of the densities in the box; 0 if it touches more than 512 bricks
  std::uint64_t reserved0;
};

/// The field of each `EnergySource` in a tick record, in steps of 2^-32 mJ.
inline constexpr std::array<std::int64_t TickRecord::*, kEnergySources> kEnergyColumns = {
    &TickRecord::energy_spring,  &TickRecord::energy_damping,   &TickRecord::energy_friction,
    &TickRecord::energy_cutting, &TickRecord::energy_limits,    &TickRecord::energy_hold,
    &TickRecord::energy_leak,    &TickRecord::energy_stabiliser};

}  // namespace kerf
