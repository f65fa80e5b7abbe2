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

/// The volumes of a run at one tick: one copy for the streams of all viewers.
///
/// A stream in the middle of a pass needs the bricks as they were when the pass began, but this
/// copy advances to the next tick for other streams. So a stream pins the blocks that it has yet to
/// send, and `update` saves the content of a pinned brick before it overwrites it. A pass is then
/// exactly the volumes of its tick. Extra memory: the bricks that changed during a pass, in the
/// worst case one volume per stream.
///
/// One thread.
class RunSnapshot {
 public:
  /// `reader` outlives this. Allocates 1 KiB per brick of the volumes.
  explicit RunSnapshot(const SegmentReader& reader);

  /// Copies the changed bricks; at most 4 passes over the versions. `writer_gone`: an unfinished
  /// last tick will never be completed, so its bricks are taken as they are.
  void update(std::int64_t now_ns, bool writer_gone);

  /// True if the last `update` got the volumes of one tick; only then may a pass begin.
  [[nodiscard]] bool whole() const noexcept { return whole_; }
  [[nodiscard]] Tick tick() const noexcept { return tick_; }
  [[nodiscard]] std::int64_t taken_ns() const noexcept { return taken_ns_; }
  /// Blocks that the last `update` changed; some may be listed twice.
  [[nodiscard]] std::span<const std::uint32_t> changed() const noexcept { return changed_; }

  [[nodiscard]] const SegmentReader& reader() const noexcept { return reader_; }
  [[nodiscard]] const BlockPlan& plan() const noexcept { return plan_; }

  /// Version of a block; 0 if it was never read completely.
  [[nodiscard]] std::uint64_t version(std::uint32_t id) const noexcept;
  /// Keeps the current version of block `id` readable until `unpin`. At most `kMaxStreams` pins per
  /// block.
  void pin(std::uint32_t id) noexcept;
  void unpin(std::uint32_t id, std::uint64_t version) noexcept;
  /// Copies a block that is pinned at `version`.
  void copy(std::uint32_t id, std::uint64_t version, std::span<std::byte> out) const noexcept;

  static constexpr std::size_t kMaxStreams = 255;

  /// Number of saved bricks.
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
  /// True for a density block. For lower ids the unsigned difference wraps to a large number.
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

/// The volume descriptors for the hello: `off_labels` is 1 if there are labels, other offsets are
/// 0.
[[nodiscard]] std::vector<VolumeDescriptor> describe_volumes(const SegmentInfo& info);

}  // namespace kerf::bridge
