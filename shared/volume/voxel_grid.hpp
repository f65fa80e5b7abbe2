// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace kerf {

// What the servo's fixed arrays hold and the segment has descriptors for; a scene file with more is
// refused.
inline constexpr std::size_t kMaxVolumes = 8;
inline constexpr std::size_t kMaxTools = 16;

/// A voxel by its number along each axis, from 0.
struct VoxelIndex {
  std::int32_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(VoxelIndex, VoxelIndex) noexcept = default;
};

/// Half-open box of voxels, lo <= i < hi on each axis; empty where any extent is not positive.
struct VoxelBox {
  VoxelIndex lo, hi;

  [[nodiscard]] constexpr bool empty() const noexcept {
    return hi.x <= lo.x || hi.y <= lo.y || hi.z <= lo.z;
  }
  [[nodiscard]] constexpr bool contains(VoxelIndex v) const noexcept {
    return v.x >= lo.x && v.y >= lo.y && v.z >= lo.z && v.x < hi.x && v.y < hi.y && v.z < hi.z;
  }
  [[nodiscard]] constexpr VoxelIndex extent() const noexcept {
    return empty() ? VoxelIndex{} : VoxelIndex{hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
  }
  [[nodiscard]] constexpr VoxelBox grown(std::int32_t by) const noexcept {
    return {{lo.x - by, lo.y - by, lo.z - by}, {hi.x + by, hi.y + by, hi.z + by}};
  }
  [[nodiscard]] constexpr VoxelBox clipped(const VoxelBox& to) const noexcept {
    return {{std::max(lo.x, to.lo.x), std::max(lo.y, to.lo.y), std::max(lo.z, to.lo.z)},
            {std::min(hi.x, to.hi.x), std::min(hi.y, to.hi.y), std::min(hi.z, to.hi.z)}};
  }
  /// Smallest box that holds both; an empty box adds nothing.
  [[nodiscard]] constexpr VoxelBox united(const VoxelBox& other) const noexcept {
    if (empty()) return other;
    if (other.empty()) return *this;
    return {{std::min(lo.x, other.lo.x), std::min(lo.y, other.lo.y), std::min(lo.z, other.lo.z)},
            {std::max(hi.x, other.hi.x), std::max(hi.y, other.hi.y), std::max(hi.z, other.hi.z)}};
  }
  /// Smallest box that holds `voxel` too.
  [[nodiscard]] constexpr VoxelBox with(VoxelIndex voxel) const noexcept {
    return united({voxel, {voxel.x + 1, voxel.y + 1, voxel.z + 1}});
  }
  [[nodiscard]] constexpr VoxelBox moved(VoxelIndex by) const noexcept {
    return {{lo.x + by.x, lo.y + by.y, lo.z + by.z}, {hi.x + by.x, hi.y + by.y, hi.z + by.z}};
  }
  friend constexpr bool operator==(const VoxelBox&, const VoxelBox&) noexcept = default;
};

/// The smallest box that holds all of `boxes`.
[[nodiscard]] constexpr VoxelBox united(std::span<const VoxelBox> boxes) noexcept {
  VoxelBox all;
  for (const VoxelBox& box : boxes) all = all.united(box);
  return all;
}

/// Extent of a volume; x runs fastest in memory. Voxel (i, j, k) is a centre.
struct VoxelGrid {
  std::int32_t nx = 0, ny = 0, nz = 0;

  [[nodiscard]] constexpr std::size_t voxel_count() const noexcept {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
           static_cast<std::size_t>(nz);
  }
  [[nodiscard]] constexpr std::size_t index(std::int32_t x, std::int32_t y,
                                            std::int32_t z) const noexcept {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(ny) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(nx) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] constexpr bool contains(VoxelIndex v) const noexcept {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < nx && v.y < ny && v.z < nz;
  }
  [[nodiscard]] constexpr VoxelBox box() const noexcept { return {{0, 0, 0}, {nx, ny, nz}}; }
  friend constexpr bool operator==(const VoxelGrid&, const VoxelGrid&) noexcept = default;
};

using Density = std::uint16_t;  ///< 0 = air, 65535 = scene maximum
using Label = std::uint8_t;     ///< material, index into the scene's material table; 0 = none
inline constexpr double kDensityMax = 65535.0;

/// Calls `take(x, y, z)` for each voxel of a box in the order of memory: x fastest, then y.
template <class Take>
constexpr void for_each_voxel(const VoxelBox& box, const Take& take) {
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) take(x, y, z);
    }
  }
}

}  // namespace kerf
