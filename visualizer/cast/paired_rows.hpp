// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// A volume for trilinear sampling: in a border of air one voxel thick, and each voxel together
/// with the next one in y, so that one load of two entries brings four corners of a cell. That
/// costs twice the memory and halves the loads, which set the pace of a ray caster.
///
///     entry (x, y, z) = voxel (x-1, y-1, z-1) | voxel (x-1, y, z-1) << bits of a voxel
template <class Voxel, class Entry>
class PairedRows {
 public:
  static_assert(sizeof(Entry) == 2 * sizeof(Voxel));

  /// Throws std::bad_alloc. All air.
  explicit PairedRows(VoxelGrid grid) : grid_(grid), entries_(entry_count(grid)) {}

  /// What a volume of this extent takes.
  [[nodiscard]] static std::size_t entry_count(VoxelGrid grid) {
    // One plane of air beyond the border, for cubes around its last voxels, and a little more: a
    // load may read beyond its last entry.
    return static_cast<std::size_t>(grid.nx + 2) * static_cast<std::size_t>(grid.ny + 1) *
               static_cast<std::size_t>(grid.nz + 3) +
           sizeof(std::uint64_t) / sizeof(Entry);
  }

  /// Takes the voxels of `box` from a whole volume, x fastest.
  void copy(const VoxelBox& box, std::span<const Voxel> volume) {
    constexpr int kBits = 8 * sizeof(Voxel);
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const Voxel* from = volume.data() + grid_.index(box.lo.x, y, z);
        Entry* own = entries_.data() + at(box.lo.x + 1, y + 1, z + 1);
        Entry* before = entries_.data() + at(box.lo.x + 1, y, z + 1);
        for (std::int32_t i = 0; i < box.hi.x - box.lo.x; ++i) {
          const auto voxel = static_cast<Entry>(from[i]);
          constexpr auto kLow = static_cast<Entry>((Entry{1} << kBits) - 1);
          own[i] = static_cast<Entry>((own[i] & ~kLow) | voxel);
          before[i] = static_cast<Entry>((before[i] & kLow) | voxel << kBits);
        }
      }
    }
  }

  [[nodiscard]] const Entry* data() const noexcept { return entries_.data(); }
  [[nodiscard]] std::int32_t row() const noexcept { return grid_.nx + 2; }
  [[nodiscard]] std::int32_t plane() const noexcept { return row() * (grid_.ny + 1); }

 private:
  [[nodiscard]] std::size_t at(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
    return static_cast<std::size_t>(z) * static_cast<std::size_t>(plane()) +
           static_cast<std::size_t>(y) * static_cast<std::size_t>(row()) +
           static_cast<std::size_t>(x);
  }

  VoxelGrid grid_;
  std::vector<Entry> entries_;
};

}  // namespace kerf
