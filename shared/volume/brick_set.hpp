// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "shared/volume/brick_grid.hpp"

namespace kerf {

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
