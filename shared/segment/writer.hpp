// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/segment/segment.hpp"
#include "shared/volume/brick_grid.hpp"

namespace kerf {

/// Bricks copied into the mirror per tick, over all volumes: 64^3 voxels, 512 KiB. A 16^3 tool
/// touches 27. Further bricks wait for the next ticks, so that even a reset of a whole volume does
/// not miss a deadline.
inline constexpr std::uint32_t kMaxBricksPerTick = 512;

/// Hash of the densities in a changed box of the volume `linear`; 0 if the box touches more than
/// kMaxBricksPerTick bricks.
[[nodiscard]] std::uint64_t changed_box_hash(const BrickGrid& bricks,
                                             std::span<const Density> linear,
                                             const VoxelBox& box) noexcept;

/// The only writer of a segment. Owns a sealed memfd, mapped and populated, which starts with the
/// volumes of tick 0.
///
/// `create` and the destructor run outside the servo. The members marked *servo* are called by one
/// thread: wait-free, no system call, no allocation; they write the segment and never read it. The
/// order in a tick is begin_tick, publish_box (0 or more), publish_state (with two arms the second
/// arm's, then the first's), end_tick.
class SegmentWriter {
 public:
  /// Throws `SegmentError` if a volume is empty, too large or does not match its spans, or if
  /// memory cannot be allocated. `virtual_time`: lock-step; `start_ns` is 0.
  [[nodiscard]] static SegmentWriter create(const SegmentSpec& spec, bool virtual_time = false);

  SegmentWriter(SegmentWriter&&) noexcept;
  SegmentWriter& operator=(SegmentWriter&&) noexcept;
  ~SegmentWriter();

  /// The sealed memfd, for `SegmentServer`; owned by the writer.
  [[nodiscard]] int fd() const noexcept;
  [[nodiscard]] std::uint64_t session_id() const noexcept;
  [[nodiscard]] std::uint64_t total_bytes() const noexcept;
  /// False if the lock limit is below `total_bytes()`: the servo can then meet a page fault.
  [[nodiscard]] bool locked() const noexcept;

  /// *Servo.* Ticks increase from 1 on. A tick that is not above the last one is taken as the last
  /// one plus 1.
  void begin_tick(Tick tick) noexcept;

  /// *Servo.* Records a changed box in the dirty ring and marks its bricks. `linear` is the whole
  /// volume, x fastest. `end_tick` reads it in this tick and, while bricks wait, in later ones, so
  /// it must outlive the writer. Returns the `box_hash` of the record; 0 if the box is too large or
  /// empty, or if the segment has no such volume or no updates.
  std::uint64_t publish_box(std::size_t volume, std::span<const Density> linear,
                            const VoxelBox& changed, std::uint32_t removed,
                            DirtyCause cause = DirtyCause::milling) noexcept;

  /// *Servo.* Appends a record to the ring of `arm`; sets `seq` and `crc32c`. With two arms each
  /// tick publishes both, arm 1 before arm 0, so that a reader finds each index of the first ring
  /// in the second too. An arm that the segment does not have is ignored.
  void publish_state(const TickRecord& record, std::size_t arm = 0) noexcept;

  /// *Servo.* Copies the changed bricks, each once, and ends the tick. While bricks wait, the epoch
  /// stays odd, so that readers know that the bricks are not all of one tick. `now_ns` becomes the
  /// heartbeat: CLOCK_MONOTONIC, in lock-step too.
  void end_tick(std::uint64_t now_ns) noexcept;

  /// Any thread, but one at a time.
  void set_lifecycle(Lifecycle lifecycle) noexcept;

  /// *Servo.* Number of bricks that wait for later ticks.
  [[nodiscard]] std::uint32_t waiting_bricks() const noexcept;

 private:
  struct State;
  explicit SegmentWriter(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace kerf
