// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/seqlock.hpp"
#include "shared/volume/brick_grid.hpp"

namespace kerf {

/// The constant part of another machine's segment. Times are of the local CLOCK_MONOTONIC.
struct MirrorSpec {
  std::uint64_t session_id = 0;
  std::uint64_t config_hash = 0;
  std::uint64_t start_ns = 0;
  std::uint32_t tick_ns = 0;
  std::uint32_t scene_bytes = 0;
  std::string build_id;                   ///< truncated to 63 characters
  std::size_t arms = 1;                   ///< 1..kMaxArms
  std::vector<VolumeDescriptor> volumes;  ///< off_labels: 0 if no labels; other offsets unused
  std::uint64_t most_bytes = std::uint64_t{1} << 31;  ///< a larger segment is refused
};

/// Writes a local copy of another machine's segment: same session, scene text, bricks, versions and
/// records, so that every reader works on it unchanged. Not for the servo; one thread.
///
/// The order is put_scene and put_labels (before a reader has the segment), then for each state of
/// the volumes begin_pass, put_brick (0 or more), end_pass. Readers see a complete pass or detect
/// that it is not complete. Text, labels and bricks outside the segment throw `SegmentError`; a
/// record of an arm that it does not have is ignored.
class ReplicaWriter {
 public:
  /// Checks `spec`, which may be hostile, before it asks for memory. Throws `SegmentError`.
  [[nodiscard]] static ReplicaWriter create(const MirrorSpec& spec);

  /// The sealed memfd, for `SegmentServer`; owned by the writer.
  [[nodiscard]] int fd() const noexcept { return memory_.fd(); }
  [[nodiscard]] std::uint64_t session_id() const noexcept { return header_.session_id; }
  [[nodiscard]] std::uint64_t total_bytes() const noexcept { return header_.total_bytes; }
  [[nodiscard]] const std::vector<VolumeDescriptor>& volumes() const noexcept { return volumes_; }

  /// Bytes of the scene text from `offset` on.
  void put_scene(std::uint64_t offset, std::span<const std::byte> text);
  /// The 512 labels of a brick, x fastest; those beyond the far faces are ignored.
  void put_labels(std::size_t volume, std::uint32_t brick, std::span<const std::byte> labels);

  /// From now on, readers see that the volumes are not those of one tick.
  void begin_pass(Tick tick) noexcept;
  /// `version` is even and above the brick's last one; `densities` are 1024 bytes.
  void put_brick(std::size_t volume, std::uint32_t brick, std::uint64_t version,
                 std::span<const std::byte> densities);
  /// From now on, the volumes are those of `tick`.
  void end_pass(Tick tick) noexcept;

  /// Appends a record to a ring; sets `seq` and, in a tick record, `crc32c`. An index that is not
  /// above the last one is ignored; skipped indices read as `ReadState::overrun`. With two arms,
  /// put the second's record of a tick before the first's, as in `SegmentWriter`.
  void put_record(std::uint64_t index, const TickRecord& record, std::size_t arm = 0) noexcept;
  void put_record(std::uint64_t index, const DirtyRecord& record) noexcept;

  /// Sets `SegmentHeader::heartbeat_ns`.
  void beat(std::uint64_t heartbeat_ns) noexcept;
  void set_lifecycle(Lifecycle lifecycle) noexcept;

 private:
  explicit ReplicaWriter(SegmentMemory memory) noexcept : memory_(std::move(memory)) {}
  [[nodiscard]] std::byte* at(std::uint64_t offset) const noexcept {
    return memory_.bytes().data() + offset;
  }
  [[nodiscard]] BrickGrid bricks_of(std::size_t volume, std::uint32_t brick) const;

  SegmentMemory memory_;
  SegmentHeader header_{};  // as written
  std::vector<VolumeDescriptor> volumes_;
  std::array<RecordRing<TickRecord>, kMaxArms> ticks_;
  RecordRing<DirtyRecord> boxes_;
};

}  // namespace kerf
