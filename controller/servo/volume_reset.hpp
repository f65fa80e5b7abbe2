// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "shared/volume/brick_grid.hpp"

// The volumes go back to their first content, a few bricks a tick and only those that were cut.
// What is derived of a density follows: gradients, and what cutting still owes. Maps of free space
// are those of the first content, which a cut leaves true. Servo thread; no heap.

namespace kerf {

/// The bricks of a volume in blocks of 4x4x4, one word each: 32 voxels per edge. Pure arithmetic.
struct BrickBlocks {
  static constexpr int kEdgeLog2 = 2;
  static constexpr std::int32_t kEdge = 1 << kEdgeLog2;

  BrickGrid bricks;
  std::int32_t nx = 0, ny = 0, nz = 0;

  [[nodiscard]] static constexpr BrickBlocks of(const VoxelGrid& grid) noexcept {
    const BrickGrid bricks = BrickGrid::of(grid);
    const auto blocks = [](std::int32_t n) { return (n + kEdge - 1) >> kEdgeLog2; };
    return {bricks, blocks(bricks.bx), blocks(bricks.by), blocks(bricks.bz)};
  }
  [[nodiscard]] constexpr std::size_t count() const noexcept {
    return VoxelGrid{nx, ny, nz}.voxel_count();
  }
  [[nodiscard]] constexpr std::size_t block(VoxelIndex brick) const noexcept {
    return VoxelGrid{nx, ny, nz}.index(brick.x >> kEdgeLog2, brick.y >> kEdgeLog2,
                                       brick.z >> kEdgeLog2);
  }
  [[nodiscard]] static constexpr int bit(VoxelIndex brick) noexcept {
    constexpr std::int32_t kIn = kEdge - 1;
    return (brick.z & kIn) << 2 * kEdgeLog2 | (brick.y & kIn) << kEdgeLog2 | (brick.x & kIn);
  }
  /// The brick of a bit of a block.
  [[nodiscard]] constexpr std::uint32_t brick_id(std::size_t block, int bit) const noexcept {
    const auto at = static_cast<std::int32_t>(block);
    const VoxelIndex first{(at % nx) << kEdgeLog2, (at / nx % ny) << kEdgeLog2,
                           (at / nx / ny) << kEdgeLog2};
    constexpr std::int32_t kIn = kEdge - 1;
    return bricks.id({first.x + (bit & kIn), first.y + (bit >> kEdgeLog2 & kIn),
                      first.z + (bit >> 2 * kEdgeLog2)});
  }
};

/// Notes that a box of a volume was cut. Bounded by the bricks of the tool's box.
inline void mark_cut(const VoxelGrid& grid, const VoxelBox& cut,
                     std::span<std::uint64_t> blocks) noexcept {
  const BrickBlocks of = BrickBlocks::of(grid);
  const VoxelBox touched = of.bricks.bricks_of(cut);
  for (std::int32_t z = touched.lo.z; z < touched.hi.z; ++z) {
    for (std::int32_t y = touched.lo.y; y < touched.hi.y; ++y) {
      for (std::int32_t x = touched.lo.x; x < touched.hi.x; ++x) {
        blocks[of.block({x, y, z})] |= std::uint64_t{1} << BrickBlocks::bit({x, y, z});
      }
    }
  }
}

/// Blocks that a tick may look at for one that was cut: 8 KiB of words.
inline constexpr int kBlocksPerTick = 1024;

/// Bricks that a tick may restore; the mirror copies as many again. 64 take 20 us with cold caches,
/// a fiftieth of a tick at 1 kHz, and 8 as much of one at 8 kHz. Where gradients are stored a brick
/// takes 80 times as long: 25 us.
[[nodiscard]] constexpr int bricks_per_tick(std::int32_t rate_hz, bool gradients) noexcept {
  const int bricks = std::clamp(64 * 1000 / std::max(rate_hz, 1), 8, 64);
  return gradients ? std::max(1, bricks / 32) : bricks;
}

/// Restores some bricks of one block, and clears their bits. Returns the box around them.
template <class N>
VoxelBox restore_bricks(const ServoPlan<N>& plan, const VoxelGrid& grid, std::size_t block,
                        VolumeState<N>& volume, GradientScratch* scratch) noexcept {
  const BrickBlocks of = BrickBlocks::of(grid);
  VoxelBox restored;
  int left = bricks_per_tick(plan.rate_hz, !volume.gradient.empty());
  for (std::uint64_t& bits = volume.cut_blocks[block]; bits != 0 && left > 0; --left) {
    const VoxelBox box = of.bricks.voxels(of.brick_id(block, std::countr_zero(bits)));
    bits &= bits - 1;
    const auto row = static_cast<std::size_t>(box.hi.x - box.lo.x);
    for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
        const std::size_t at = grid.index(box.lo.x, y, z);
        copy_row(&volume.density[at], &volume.first[at], row);
      }
    }
    if (!volume.gradient.empty()) {
      refresh_gradients<N>(plan.kernel, grid, volume.density, box, volume.gradient, *scratch);
    }
    restored = restored.united(box);
  }
  return restored;
}

/// What cutting still owes a volume is of matter that has come back. One value for each lane of the
/// widest tool.
template <class N>
void forget_debts(ServoState<N>& state, std::size_t v) noexcept {
  std::ranges::fill(state.volumes[v].carry, RemovalCarry<N>{});
  state.force_cut.volume[v] = {};
}

/// The last matter has come back.
template <class N>
void end_restoring(ServoState<N>& state) noexcept {
  state.force_cut.change_tool();  // it stands, and has cut nothing of what is there now
  restart_fade(state.supervisor);
}

/// One tick of a reset that runs: some bricks of one block, told in `changed` by volume of the
/// scene. The last tick of a reset ends it.
template <class N>
void restore_some(const ServoPlan<N>& plan, ServoState<N>& state,
                  std::array<VoxelBox, kMaxVolumes>& changed) noexcept {
  ResetState& reset = state.reset;
  for (int looks = kBlocksPerTick; looks > 0; --looks) {
    if (reset.volume == plan.volume_count) {
      reset = {};
      end_restoring(state);
      return;
    }
    VolumeState<N>& volume = state.volumes[reset.volume];
    if (reset.block == volume.cut_blocks.size()) {
      forget_debts(state, reset.volume);
      ++reset.volume;
      reset.block = 0;
    } else if (volume.cut_blocks[reset.block] == 0) {
      ++reset.block;
    } else {
      const VolumePlan<N>& of = plan.volumes[reset.volume];
      changed[of.scene_index] =
          restore_bricks(plan, of.grid, reset.block, volume, state.gradient_scratch);
      return;
    }
  }
}

}  // namespace kerf
