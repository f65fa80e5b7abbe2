// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "bridge/wire/messages.hpp"
#include "shared/segment/reader.hpp"

namespace kerf::bridge {

/// The volumes of a run at one tick, one copy for the streams of all viewers.
///
/// A stream in the middle of a pass needs the bricks as they were when the pass began, while this
/// copy advances to the next tick for the others. So a stream pins the blocks that it has yet to
/// send, and `update` keeps the old content of a pinned brick before it reads the new one. A pass
/// is then exactly the volumes of its tick. Memory: the bricks that changed during a pass, in the
/// worst case one volume per stream.
///
/// One thread.
class RunSnapshot {
 public:
  /// The reader outlives this. Allocates the volumes' bricks, 1 KiB each.
  explicit RunSnapshot(const SegmentReader& reader);

  /// Reads what changed; at most 4 passes over the versions. `writer_gone`: the last publication
  /// will never be completed, so it is taken as it is.
  void update(std::int64_t now_ns, bool writer_gone);

  /// True if the last `update` found the volumes of one tick; only then a pass may begin.
  [[nodiscard]] bool whole() const noexcept { return whole_; }
  [[nodiscard]] Tick tick() const noexcept { return tick_; }
  [[nodiscard]] std::int64_t taken_ns() const noexcept { return taken_ns_; }
  /// Blocks that the last `update` changed; some may be listed twice.
  [[nodiscard]] std::span<const std::uint32_t> changed() const noexcept { return changed_; }

  [[nodiscard]] const SegmentReader& reader() const noexcept { return reader_; }
  [[nodiscard]] const BlockPlan& plan() const noexcept { return plan_; }

  /// 0: never read whole.
  [[nodiscard]] std::uint64_t version(std::uint32_t id) const noexcept;
  /// Keeps the present version of block `id` readable until `unpin`. At most `kMaxStreams` pins.
  void pin(std::uint32_t id) noexcept;
  void unpin(std::uint32_t id, std::uint64_t version) noexcept;
  /// Copies a block that is pinned at `version`.
  void copy(std::uint32_t id, std::uint64_t version, std::span<std::byte> out) const noexcept;

  static constexpr std::size_t kMaxStreams = 255;

  /// Bricks that are kept aside.
  [[nodiscard]] std::size_t kept() const noexcept { return kept_.size(); }

 private:
  using Brick = std::array<Density, kBrickVoxels>;
  struct Kept {
    Brick brick;
    std::uint8_t pins;
  };

  [[nodiscard]] bool read_changed();
  void replace(std::uint32_t id, std::uint64_t version, const Brick& brick);
  void copy_text(std::uint32_t block, std::span<std::byte> out) const noexcept;
  void copy_labels(const BlockPlane& plane, std::uint32_t brick,
                   std::span<std::byte> out) const noexcept;
  /// Whether a block is one of density. (The difference of unsigned numbers wraps for lower ones.)
  [[nodiscard]] bool is_density(std::uint32_t id) const noexcept {
    return id - first_density_ < versions_.size();
  }

  const SegmentReader& reader_;
  BlockPlan plan_;
  std::uint32_t first_density_ = 0;
  std::vector<Brick> bricks_;
  std::vector<std::uint64_t> versions_;
  std::vector<std::uint8_t> pins_;
  std::map<std::pair<std::uint32_t, std::uint64_t>, Kept> kept_;  // by block and version
  std::vector<std::uint32_t> changed_, scanned_;
  bool whole_ = false;
  Tick tick_ = 0;
  std::int64_t taken_ns_ = 0;
};

/// The static part of a run as the greeting has it: `off_labels` 1 if there are labels.
[[nodiscard]] std::vector<VolumeDescriptor> describe_volumes(const SegmentInfo& info);

}  // namespace kerf::bridge
