// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/segment/segment.hpp"
#include "shared/volume/changed_bricks.hpp"

namespace kerf {

/// Private, checked copy of one volume descriptor.
struct SegmentVolumeInfo {
  VoxelGrid grid;
  BrickGrid bricks;
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};  ///< world position of the centre of voxel (0, 0, 0)
  std::array<float, 4> orientation{0, 0, 0, 1};
  std::uint32_t material = 0;
  std::uint32_t iso = 0;
  bool has_labels = false;
  std::uint64_t initial_hash = 0;
  std::uint64_t off_versions = 0, off_bricks = 0, off_labels = 0;
};

/// Private, checked copy of everything in the segment that never changes.
struct SegmentInfo {
  std::uint64_t session_id = 0;
  std::uint64_t config_hash = 0;
  std::uint64_t start_ns = 0;
  std::uint64_t total_bytes = 0;
  std::uint32_t tick_ns = 0;
  std::string build_id;
  std::string scene_json;
  std::vector<SegmentVolumeInfo> volumes;
  std::size_t arms = 1;  ///< 1..kMaxArms; each has a ring of tick records
  std::array<std::uint64_t, kMaxArms> off_state{};  ///< per arm; 0 if there is no such arm
  std::uint64_t off_dirty = 0;
  std::uint32_t state_slots = 0, dirty_slots = 0;
};

/// Throws `SegmentError` with both versions or both hashes if the controller was built with another
/// layout.
void require_same_layout(std::uint32_t major, std::uint32_t minor, std::uint64_t abi_hash);

/// Checks `segment`, which may be hostile, and copies its static part. Checks the copies, so that
/// the segment cannot change after a check; no check adds offsets, which could overflow; allocates
/// no more than the segment's size. Throws `SegmentError`.
[[nodiscard]] SegmentInfo parse_segment(std::span<std::byte> segment);

/// A reader's copy of one volume between frames.
struct VolumeSnapshot {
  std::uint64_t session_id = 0;         ///< a snapshot of another segment is copied again in full
  std::vector<Density> density;         ///< linear, x fastest
  std::vector<std::uint64_t> versions;  ///< per brick, as copied; 0: not yet
  ChangedBricks changed;                ///< bricks that the last `update` copied
  Tick tick = 0;                        ///< if `consistent`: the tick of `density`
  bool consistent = false;
};

enum class ReadState : std::uint8_t {
  ok,
  not_yet,  ///< the index is not published yet
  overrun,  ///< the slot holds a later record: the reader was too slow
  busy,     ///< no try gave a consistent copy; the writer may have died while writing
};

/// A read-only view of a segment. Never waits and never writes; each call has a bounded number of
/// tries, so a dead or hostile writer cannot make it hang. One thread per reader; several
/// readers may map one segment.
class SegmentReader {
 public:
  /// Maps `fd`, which the caller keeps. Throws `SegmentError` if it is not sealed against shrinking
  /// or its header is invalid; the message has both hashes of an ABI mismatch, or both versions.
  [[nodiscard]] static SegmentReader map(int fd);

  SegmentReader(SegmentReader&&) noexcept;
  SegmentReader& operator=(SegmentReader&&) noexcept;
  ~SegmentReader();

  [[nodiscard]] const SegmentInfo& info() const noexcept { return info_; }

  // `arm`: 0 is the first. An arm that the segment does not have has no records.

  /// The newest tick record of an arm; empty before the first one, or if no try gave a consistent
  /// copy.
  /// Two calls may return records of different ticks; `second_of` returns one of the same tick.
  [[nodiscard]] std::optional<TickRecord> latest(std::size_t arm = 0) const noexcept;
  /// The second arm's record of the same tick as `first`, a record of the first arm. Empty if there
  /// is one arm, or if the record is no longer in the ring.
  [[nodiscard]] std::optional<TickRecord> second_of(const TickRecord& first) const noexcept;

  /// Number of records published so far. The last `state_slots` of them are readable. The second
  /// arm's record is published before the first's, so below state_head(0) both exist.
  [[nodiscard]] std::uint64_t state_head(std::size_t arm = 0) const noexcept;
  [[nodiscard]] std::uint64_t dirty_head() const noexcept;
  /// `out` changes only if the result is `ok`.
  [[nodiscard]] ReadState state_at(std::uint64_t index, TickRecord& out,
                                   std::size_t arm = 0) const noexcept;
  [[nodiscard]] ReadState dirty_at(std::uint64_t index, DirtyRecord& out) const noexcept;

  /// Labels of a volume, x fastest; empty if it has none. Lives as long as the reader.
  [[nodiscard]] std::span<const Label> labels(std::size_t volume) const noexcept;

  [[nodiscard]] std::uint64_t heartbeat_ns() const noexcept;
  [[nodiscard]] Lifecycle lifecycle() const noexcept;

  /// Copies the bricks whose version differs from that in `snapshot`; into a new snapshot, all. At
  /// most 4 passes over the versions, and 64 tries per brick; a brick that stays busy keeps its old
  /// copy. If the result is `consistent`, the density is exactly the volume of `tick`.
  void update(std::size_t volume, VolumeSnapshot& snapshot) const;

  // For a reader that keeps bricks, of all volumes at one tick: it calls `epoch`, copies the
  // changed bricks, and calls `unchanged_since`. If the epoch is even and did not change, all
  // bricks are of its tick.

  /// Version word of all volumes together.
  [[nodiscard]] std::uint64_t epoch() const noexcept;
  /// True if nothing was published since `epoch` returned `seen`.
  [[nodiscard]] bool unchanged_since(std::uint64_t seen) const noexcept;
  /// Appends to `ids` the bricks of `volume` whose version differs from `seen[id]`. `seen` has one
  /// version per brick.
  void changed_bricks(std::size_t volume, std::span<const std::uint64_t> seen,
                      std::vector<std::uint32_t>& ids) const;
  /// Copies a brick, x fastest, zeros beyond the far faces. Returns its version, or 0 if none
  /// of 64 tries gave a consistent copy; `out` is then undefined.
  [[nodiscard]] std::uint64_t read_brick(std::size_t volume, std::uint32_t id,
                                         std::span<Density, kBrickVoxels> out) const noexcept;
  /// Drops the mapped pages. The system counts pages that were read as memory of this process,
  /// although the controller owns them; after this call only those that are read again count.
  void forget_pages() const noexcept;

 private:
  SegmentReader(std::span<std::byte> bytes, SegmentInfo info) noexcept;
  template <class Record>
  [[nodiscard]] ReadState record_at(std::uint64_t offset, std::uint32_t slots, std::uint64_t head,
                                    std::uint64_t index, Record& out) const noexcept;
  [[nodiscard]] bool copy_changed(const SegmentVolumeInfo& volume, VolumeSnapshot& snapshot) const;

  std::span<std::byte> bytes_;  // mapped PROT_READ
  SegmentInfo info_;
};

}  // namespace kerf
