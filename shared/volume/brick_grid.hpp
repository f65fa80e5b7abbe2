// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

// Bricks: the cubes of voxels in which a volume is mirrored and uploaded.

inline constexpr std::int32_t kBrickLog2 = 3;
inline constexpr std::int32_t kBrickEdge = 1 << kBrickLog2;
inline constexpr std::size_t kBrickVoxels = 512;

/// A row of a brick along x: 16 bytes. Row (y, z) is the `brick_row`-th of its brick.
using BrickRow = std::array<Density, kBrickEdge>;
[[nodiscard]] constexpr std::size_t brick_row(std::int32_t y, std::int32_t z) noexcept {
  return static_cast<std::size_t>(z) * kBrickEdge + static_cast<std::size_t>(y);
}

/// Copies `voxels` densities, 1..8; the whole row, by far the most frequent, at constant size.
inline void copy_row(Density* to, const Density* from, std::size_t voxels) noexcept {
  if (voxels == kBrickEdge) {
    std::memcpy(to, from, sizeof(BrickRow));
  } else {
    std::memcpy(to, from, voxels * sizeof(Density));
  }
}

/// How a volume is cut into bricks of 8^3 voxels: brick (x, y, z) has the id (z by + y) bx + x,
/// voxels x fastest inside a brick, zeros beyond the far faces. Pure arithmetic; any thread.
struct BrickGrid {
  VoxelGrid grid;
  std::int32_t bx = 0, by = 0, bz = 0;  ///< bricks per axis

  [[nodiscard]] static constexpr BrickGrid of(const VoxelGrid& grid) noexcept {
    const auto bricks = [](std::int32_t n) { return (n + kBrickEdge - 1) >> kBrickLog2; };
    return {grid, bricks(grid.nx), bricks(grid.ny), bricks(grid.nz)};
  }
  [[nodiscard]] constexpr std::uint32_t count() const noexcept {
    return static_cast<std::uint32_t>(bx) * static_cast<std::uint32_t>(by) *
           static_cast<std::uint32_t>(bz);
  }
  [[nodiscard]] constexpr std::uint32_t id(VoxelIndex brick) const noexcept {
    return static_cast<std::uint32_t>((brick.z * by + brick.y) * bx + brick.x);
  }
  [[nodiscard]] constexpr VoxelIndex brick(std::uint32_t id) const noexcept {
    const auto i = static_cast<std::int32_t>(id);
    return {i % bx, i / bx % by, i / bx / by};
  }
  /// The voxels of brick `id` that exist: 8^3, less at the far faces.
  [[nodiscard]] constexpr VoxelBox voxels(std::uint32_t id) const noexcept {
    const VoxelIndex b = brick(id);
    const VoxelIndex lo{b.x << kBrickLog2, b.y << kBrickLog2, b.z << kBrickLog2};
    return VoxelBox{lo, {lo.x + kBrickEdge, lo.y + kBrickEdge, lo.z + kBrickEdge}}.clipped(
        grid.box());
  }
  /// Bricks that a box of voxels touches, as a half-open box of brick indices; `box` is clipped.
  [[nodiscard]] constexpr VoxelBox bricks_of(const VoxelBox& box) const noexcept {
    const VoxelBox in = box.clipped(grid.box());
    if (in.empty()) return {};
    return {{in.lo.x >> kBrickLog2, in.lo.y >> kBrickLog2, in.lo.z >> kBrickLog2},
            {((in.hi.x - 1) >> kBrickLog2) + 1, ((in.hi.y - 1) >> kBrickLog2) + 1,
             ((in.hi.z - 1) >> kBrickLog2) + 1}};
  }
  /// Number of them.
  [[nodiscard]] constexpr std::uint32_t touched_by(const VoxelBox& box) const noexcept {
    const VoxelIndex bricks = bricks_of(box).extent();
    return static_cast<std::uint32_t>(bricks.x) * static_cast<std::uint32_t>(bricks.y) *
           static_cast<std::uint32_t>(bricks.z);
  }
};

}  // namespace kerf
