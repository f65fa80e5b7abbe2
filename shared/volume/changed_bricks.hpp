// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <vector>

#include "shared/volume/brick_grid.hpp"

namespace kerf {

/// A set of voxels of one brick: voxel (x, y, z) is bit 8y + x of word z.
using VoxelMask = std::array<std::uint64_t, kBrickEdge>;

/// Row of a `VoxelMask`: bit i is set if densities i of `a` and `b` differ, i < voxels <= 8.
[[nodiscard]] inline std::uint64_t differing(const Density* a, const Density* b,
                                             std::int32_t voxels) noexcept {
  std::uint64_t bits = 0;
  for (std::int32_t i = 0; i < voxels; ++i) bits |= std::uint64_t{a[i] != b[i]} << i;
  return bits;
}

/// The smallest box around a set of voxels, counted from the brick's first; empty if the set is.
[[nodiscard]] constexpr VoxelBox bounds_of(const VoxelMask& voxels) noexcept {
  std::uint64_t any = 0;  // of the layers
  std::int32_t z0 = kBrickEdge, z1 = 0;
  for (std::int32_t z = 0; z < kBrickEdge; ++z) {
    if (voxels[static_cast<std::size_t>(z)] == 0) continue;
    any |= voxels[static_cast<std::size_t>(z)];
    z0 = std::min(z0, z);
    z1 = z + 1;
  }
  if (any == 0) return {};
  std::uint64_t row = any;  // its low byte: of all rows
  for (const int shift : {32, 16, 8}) row |= row >> shift;
  const auto x = static_cast<std::uint8_t>(row);
  return {{std::countr_zero(x), std::countr_zero(any) / kBrickEdge, z0},
          {std::bit_width(x), kBrickEdge - std::countl_zero(any) / kBrickEdge, z1}};
}

/// A brick that was copied, and which of its voxels have another density since.
struct ChangedBrick {
  std::uint32_t id = 0;
  VoxelMask voxels{};
  friend bool operator==(const ChangedBrick&, const ChangedBrick&) noexcept = default;
};

/// Changes of one volume: bricks by ascending id, each once. One thread.
class ChangedBricks {
 public:
  /// Adds to what is known of the brick. Fast for ids that ascend.
  void add(const ChangedBrick& brick) {
    auto at = bricks_.end();
    if (!bricks_.empty() && brick.id <= bricks_.back().id) {
      at = std::lower_bound(bricks_.begin(), bricks_.end(), brick.id,
                            [](const ChangedBrick& one, std::uint32_t id) { return one.id < id; });
    }
    if (at == bricks_.end() || at->id != brick.id) {
      bricks_.insert(at, brick);
      return;
    }
    for (std::size_t z = 0; z < brick.voxels.size(); ++z) at->voxels[z] |= brick.voxels[z];
  }
  void add(const ChangedBricks& others) {
    std::vector<ChangedBrick> all;
    std::merge(bricks_.begin(), bricks_.end(), others.bricks_.begin(), others.bricks_.end(),
               std::back_inserter(all),
               [](const ChangedBrick& a, const ChangedBrick& b) { return a.id < b.id; });
    bricks_.clear();
    for (const ChangedBrick& brick : all) add(brick);
  }
  void clear() noexcept { bricks_.clear(); }

  [[nodiscard]] bool empty() const noexcept { return bricks_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return bricks_.size(); }
  [[nodiscard]] auto begin() const noexcept { return bricks_.begin(); }
  [[nodiscard]] auto end() const noexcept { return bricks_.end(); }

  /// Calls `take(box)` for each 2^3 voxels of a brick in which voxels changed, with the smallest
  /// box around these: together the boxes follow the shape of a cut. `bricks` is that of the
  /// volume.
  template <class Take>
  void for_each_box(const BrickGrid& bricks, const Take& take) const {
    for (const ChangedBrick& brick : bricks_) {
      const VoxelIndex first = bricks.voxels(brick.id).lo;
      for (std::int32_t part = 0; part < 64; ++part) {
        const int low_bit = 16 * (part / 4 % 4) + 2 * (part % 4);
        const std::uint64_t rows = std::uint64_t{0x0303} << low_bit;
        const auto z = 2 * static_cast<std::size_t>(part / 16);
        VoxelMask within{};
        within[z] = brick.voxels[z] & rows;
        within[z + 1] = brick.voxels[z + 1] & rows;
        if (const VoxelBox box = bounds_of(within); !box.empty()) take(box.moved(first));
      }
    }
  }
  /// The smallest box around all voxels that changed.
  [[nodiscard]] VoxelBox bounds(const BrickGrid& bricks) const noexcept {
    VoxelBox all;
    for (const ChangedBrick& brick : bricks_) all = all.united(bounds(brick, bricks));
    return all;
  }
  /// The changed voxels of one brick.
  [[nodiscard]] static VoxelBox bounds(const ChangedBrick& brick,
                                       const BrickGrid& bricks) noexcept {
    return bounds_of(brick.voxels).moved(bricks.voxels(brick.id).lo);
  }

 private:
  std::vector<ChangedBrick> bricks_;
};

/// Compares two contents of a volume, x fastest.
[[nodiscard]] inline ChangedBricks changed_between(const BrickGrid& bricks,
                                                   std::span<const Density> before,
                                                   std::span<const Density> after) {
  ChangedBricks changed;
  for (std::uint32_t id = 0; id < bricks.count(); ++id) {
    ChangedBrick brick{id};
    const VoxelBox box = bricks.voxels(id);
    bool any = false;
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const std::size_t row = bricks.grid.index(box.lo.x, y, z);
        const std::uint64_t bits = differing(&before[row], &after[row], box.hi.x - box.lo.x);
        brick.voxels[static_cast<std::size_t>(z - box.lo.z)] |= bits << 8 * (y - box.lo.y);
        any = any || bits != 0;
      }
    }
    if (any) changed.add(brick);
  }
  return changed;
}

/// The bricks of one volume that wait to be copied: one bit each, taken round-robin by words of 64,
/// so that with a budget of 64 or more no brick starves, however much changes. Allocates only in
/// the constructor.
class BrickSet {
 public:
  explicit BrickSet(const BrickGrid& bricks) : bricks_(bricks), bits_(bricks.count() / 64 + 1) {}

  [[nodiscard]] std::uint32_t waiting() const noexcept { return waiting_; }

  /// Marks the bricks that `box` touches; a box of voxels, clipped to the volume.
  void mark(const VoxelBox& box) noexcept {
    const VoxelBox touched = bricks_.bricks_of(box);
    if (touched.empty()) return;
    if (waiting_ == 0) {
      changed_ = {};
      first_ = bits_.size();
      last_ = 0;
    }
    changed_ = changed_.united(box);
    first_ = std::min<std::size_t>(first_, bricks_.id(touched.lo) / 64);
    const VoxelIndex end = touched.hi;
    last_ = std::max<std::size_t>(last_, bricks_.id({end.x - 1, end.y - 1, end.z - 1}) / 64);
    if (waiting_ == 0) cursor_ = first_;
    for (std::int32_t z = touched.lo.z; z < end.z; ++z) {
      for (std::int32_t y = touched.lo.y; y < end.y; ++y) {
        mark_run(bricks_.id({touched.lo.x, y, z}), bricks_.id({end.x - 1, y, z}));
      }
    }
  }

  /// Calls `copy(id, changed)` for at most `budget` waiting bricks, each once; `changed` holds
  /// every voxel marked since no brick waited. Returns how many.
  template <class Copy>
  std::uint32_t take(std::uint32_t budget, Copy copy) noexcept {
    std::uint32_t taken = 0;
    while (waiting_ != 0 && taken < budget) {
      std::uint64_t& bits = bits_[cursor_];
      for (; bits != 0 && taken < budget; bits &= bits - 1, ++taken, --waiting_) {
        copy(static_cast<std::uint32_t>(cursor_ * 64) +
                 static_cast<std::uint32_t>(std::countr_zero(bits)),
             changed_);
      }
      if (bits == 0) cursor_ = cursor_ < last_ ? cursor_ + 1 : first_;
    }
    return taken;
  }

 private:
  void mark_run(std::uint32_t first_id, std::uint32_t last_id) noexcept {
    for (std::size_t i = first_id / 64; i <= last_id / 64; ++i) {
      std::uint64_t mask = ~std::uint64_t{0};
      if (i == first_id / 64) mask &= ~std::uint64_t{0} << first_id % 64;
      if (i == last_id / 64) mask &= ~std::uint64_t{0} >> (63 - last_id % 64);
      waiting_ += static_cast<std::uint32_t>(std::popcount(mask & ~bits_[i]));
      bits_[i] |= mask;
    }
  }

  BrickGrid bricks_;
  std::vector<std::uint64_t> bits_;
  std::uint32_t waiting_ = 0;
  VoxelBox changed_;                  // union of the boxes marked since nothing waited
  std::size_t first_ = 0, last_ = 0;  // words that may hold bits
  std::size_t cursor_ = 0;            // where the last `take` stopped, within them
};

}  // namespace kerf
