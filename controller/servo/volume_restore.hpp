// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/sampling.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/brick_grid.hpp"

// Restores volumes: reset to the first content, undo and redo of strokes, a few bricks a tick.
// Servo thread; no heap.

namespace kerf {

// Reset: restores only bricks that were cut, and what depends on density: gradients, and the carry
// of cutting. Maps of free space are those of the first content, and stay valid after any cut.

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

/// Marks that a box of a volume was cut. Bounded by the bricks of the tool's box.
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

/// Most blocks that a tick checks for a cut: 8 KiB of words.
inline constexpr int kBlocksPerTick = 1024;

/// Most bricks that a tick restores; the mirror also copies each of them. 64 take 20 us with cold
/// caches, a fiftieth of a tick at 1 kHz, and 8 take the same fraction of a tick at 8 kHz. If
/// gradients are stored, a brick takes 80 times as long: 25 us.
[[nodiscard]] constexpr int bricks_per_tick(std::int32_t rate_hz, bool gradients) noexcept {
  const int bricks = static_cast<int>(
      std::clamp<std::int32_t>(64 * 1000 / std::max<std::int32_t>(rate_hz, 1), 8, 64));
  return gradients ? std::max(1, bricks / 32) : bricks;
}

/// Restores bricks of one block, and clears their bits. Returns the box around them.
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
      refresh_gradients<N>(plan.gradient_kernel, grid, volume.density, box, volume.gradient,
                           *scratch);
    }
    restored = restored.united(box);
  }
  return restored;
}

/// Clears the carry of a restored volume: one value for each lane of the widest tool, of each arm.
template <class N>
void forget_debts(Arms<N> arms, std::size_t v) noexcept {
  for (const Arm<N>& arm : arms) {
    std::ranges::fill(arm.state->volumes[v].carry, RemovalCarry<N>{});
    arm.state->force_cut.volume[v] = {};
  }
}

/// Ends a reset, undo or redo: resets the cutting state of every tool, and fades the force in
/// again.
template <class N>
void end_restoring(Arms<N> arms) noexcept {
  for (const Arm<N>& arm : arms) {
    arm.state->force_cut.change_tool();
    restart_fade(arm.state->supervisor);
  }
}

/// One tick of a running reset: restores bricks of one block, and sets `changed` by volume of the
/// scene. The last tick ends the reset.
template <class N>
void restore_some(Arms<N> arms, std::array<VoxelBox, kMaxVolumes>& changed) noexcept {
  const ServoPlan<N>& plan = *arms.front().plan;
  ServoState<N>& state = *arms.front().state;
  ResetState& reset = state.history->reset;
  for (int looks = kBlocksPerTick; looks > 0; --looks) {
    if (reset.volume == plan.volume_count) {
      reset = {};
      for (const Arm<N>& arm : arms) arm.state->force_cut.wear = {};  // new burs
      end_restoring(arms);
      return;
    }
    VolumeState<N>& volume = state.volumes[reset.volume];
    if (reset.block == volume.cut_blocks.size()) {
      forget_debts(arms, reset.volume);
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

// Undo: every brick is saved before the first cut of the stroke in it. Each cut saves the bricks
// that it may reach; a brick that was saved and then not cut belongs to the next stroke, since it
// did not change. A stroke that does not fit into its room cannot be undone, nor can older ones.

/// Bricks of a pool that all strokes together may take; the others are for the next cuts.
[[nodiscard]] constexpr std::size_t stroke_room(std::size_t pool) noexcept {
  return pool - pool / 4;
}

/// Drops the bricks that wait for the next stroke.
inline void forget_waiting(StrokeState& stroke) noexcept {
  stroke.end = stroke.from;
  stroke.lost = false;
  ++stroke.generation;
}

inline void forget_oldest(StrokeState& stroke) noexcept {
  std::shift_left(stroke.strokes.begin(), stroke.strokes.end(), 1);
  --stroke.all;
  if (stroke.done > 0) --stroke.done;
}

/// Drops the oldest strokes until all that is in the pool leaves `room`, or none is left.
inline void keep_within(std::size_t room, StrokeState& stroke) noexcept {
  while (stroke.all > 0 && stroke.end - stroke.strokes[0].begin > room) forget_oldest(stroke);
}

/// Called if a brick of the next cut has no room. The open stroke and all before it are lost; if
/// none is open, the stroke that may begin in this tick is lost.
inline void lose_stroke(StrokeState& stroke) noexcept {
  stroke.lost = true;
  if (stroke.open) stroke.done = stroke.all = 0;
}

/// Returns the next entry of the pool, and drops the oldest strokes to make room for it. If the
/// stroke itself has used up its room, it is lost, and the result is null.
inline KeptBrick* entry_for_brick(StrokeState& stroke) noexcept {
  const std::size_t pool = stroke.pool.size(), room = stroke_room(pool);
  if (stroke.end - stroke.from >= (stroke.open ? room : pool - room)) {
    lose_stroke(stroke);
    return nullptr;
  }
  keep_within(pool - 1, stroke);
  return &stroke.pool[static_cast<std::size_t>(stroke.end++ % pool)];
}

/// Saves the bricks around a tool at `centre_vox`, each once per stroke. Copies at most the bricks
/// of the tool's box; the cut that follows visits each voxel of that box anyway.
template <class N>
void keep_bricks(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                 const VoxelVec<typename N::Real>& centre_vox) noexcept {
  const VoxelGrid& grid = plan.volumes[v].grid;
  const std::array<std::int32_t, 3>& reach = plan.tools[state.active_tool].in_volume[v].reach_vox;
  StrokeState& stroke = state.history->stroke;
  const auto whole = [](typename N::Real at) {
    constexpr double kLimit = kPositionLimitVox;
    const double plain = as_double(at);
    if (!(plain > -kLimit && plain < kLimit)) return kPositionLimitVox;  // outside of every volume
    return static_cast<std::int32_t>(plain + kLimit) - kPositionLimitVox;
  };
  const VoxelIndex at{whole(centre_vox.x), whole(centre_vox.y), whole(centre_vox.z)};
  const BrickGrid bricks = BrickGrid::of(grid);
  const VoxelBox around =
      bricks.bricks_of({{at.x - reach[0], at.y - reach[1], at.z - reach[2]},
                        {at.x + reach[0] + 1, at.y + reach[1] + 1, at.z + reach[2] + 1}});
  for (std::int32_t z = around.lo.z; z < around.hi.z; ++z) {
    for (std::int32_t y = around.lo.y; y < around.hi.y; ++y) {
      for (std::int32_t x = around.lo.x; x < around.hi.x; ++x) {
        const std::uint32_t id = bricks.id({x, y, z});
        std::uint32_t& kept_in = stroke.kept_in[v][id];
        if (kept_in == stroke.generation) continue;
        KeptBrick* const kept = entry_for_brick(stroke);
        if (kept == nullptr) return;
        kept_in = stroke.generation;
        kept->volume = static_cast<std::uint32_t>(v);
        kept->id = id;
        const VoxelBox box = bricks.voxels(id);
        const auto row = static_cast<std::size_t>(box.hi.x - box.lo.x);
        std::size_t to = 0;
        for (std::int32_t k = box.lo.z; k < box.hi.z; ++k) {
          for (std::int32_t j = box.lo.y; j < box.hi.y; ++j, to += row) {
            copy_row(&kept->density[to], &state.volumes[v].density[grid.index(box.lo.x, j, k)],
                     row);
          }
        }
      }
    }
  }
}

/// Ends the open stroke: bricks that are saved from now on belong to the next one.
inline void close_stroke(StrokeState& stroke) noexcept {
  if (!stroke.lost) {
    if (stroke.done == kUndoLevels) forget_oldest(stroke);
    stroke.strokes[stroke.done] = {stroke.from, stroke.end};
    stroke.all = ++stroke.done;
    keep_within(stroke_room(stroke.pool.size()), stroke);
  }
  stroke.from = stroke.end;
  stroke.open = stroke.lost = false;
  ++stroke.generation;
}

/// Drops all bricks, before the volumes change by a reset.
inline void forget_strokes(StrokeState& stroke) noexcept {
  stroke.done = stroke.all = 0;
  stroke.open = false;
  stroke.motion = StrokeState::Motion::none;
  forget_waiting(stroke);
}

/// Called at the end of a tick that restores nothing. A cut begins a stroke, which drops the undone
/// ones, or continues it. `pause_ticks` without a cut and without a tool that `holds_on`, by
/// contact or by the pedal, end it.
inline void follow_stroke(std::uint32_t pause_ticks, bool cuts, bool holds_on,
                          StrokeState& stroke) noexcept {
  if (cuts && !stroke.open) {
    stroke.open = true;
    stroke.all = stroke.done;
    if (stroke.lost) lose_stroke(stroke);
  }
  if (!stroke.open) {
    if (stroke.lost) forget_waiting(stroke);
    return;
  }
  stroke.quiet_ticks = cuts || holds_on ? 0 : stroke.quiet_ticks + 1;
  if (stroke.quiet_ticks >= pause_ticks) close_stroke(stroke);
}

/// Starts to undo the last stroke, even if it has not ended. Returns false if there is none, or if
/// it was too long.
inline bool begin_undo(StrokeState& stroke) noexcept {
  if (!stroke.can_undo()) return false;
  if (stroke.open) {
    close_stroke(stroke);
  } else {
    forget_waiting(stroke);
  }
  stroke.moving = stroke.strokes[--stroke.done];
  stroke.motion = StrokeState::Motion::undo;
  return true;
}

/// Starts to repeat the stroke that was undone last. Returns false if there is none.
inline bool begin_redo(StrokeState& stroke) noexcept {
  if (!stroke.can_redo()) return false;
  forget_waiting(stroke);
  stroke.moving = stroke.strokes[stroke.done++];
  stroke.motion = StrokeState::Motion::redo;
  return true;
}

/// Swaps a saved brick with that of the volume. Returns its box; adds the density that comes back
/// to `returned`, and the density that goes to `removed`.
template <class N>
VoxelBox swap_brick(const ServoPlan<N>& plan, KeptBrick& kept, ServoState<N>& state,
                    std::uint64_t& returned, std::uint64_t& removed) noexcept {
  const VoxelGrid& grid = plan.volumes[kept.volume].grid;
  VolumeState<N>& volume = state.volumes[kept.volume];
  const VoxelBox box = BrickGrid::of(grid).voxels(kept.id);
  const auto row = static_cast<std::size_t>(box.hi.x - box.lo.x);
  std::size_t from = 0;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y, from += row) {
      Density* const to = &volume.density[grid.index(box.lo.x, y, z)];
      for (std::size_t i = 0; i < row; ++i) {
        Density& other = kept.density[from + i];
        (other > to[i] ? returned : removed) +=
            static_cast<std::uint64_t>(other > to[i] ? other - to[i] : to[i] - other);
        std::swap(other, to[i]);
      }
    }
  }
  if (!volume.gradient.empty()) {
    refresh_gradients<N>(plan.gradient_kernel, grid, volume.density, box, volume.gradient,
                         *state.gradient_scratch);
  }
  return box;
}

/// One tick of a running undo or redo: swaps bricks of one volume that are close to each other, and
/// reports their box in `out`. The last tick ends it.
template <class N>
void swap_some(Arms<N> arms, ServoOutput& out) noexcept {
  constexpr std::int32_t kWidest = BrickBlocks::kEdge * kBrickEdge;  // as a block of a reset
  const ServoPlan<N>& plan = *arms.front().plan;
  ServoState<N>& state = *arms.front().state;
  StrokeState& stroke = state.history->stroke;
  Stroke& rest = stroke.moving;
  if (rest.begin == rest.end) {
    stroke.motion = StrokeState::Motion::none;
    for (std::size_t v = 0; v < plan.volume_count; ++v) forget_debts(arms, v);
    end_restoring(arms);
    return;
  }
  const auto last = [&]() -> KeptBrick& {
    return stroke.pool[static_cast<std::size_t>((rest.end - 1) % stroke.pool.size())];
  };
  const std::uint32_t v = last().volume;
  const VolumePlan<N>& volume = plan.volumes[v];
  const BrickGrid bricks = BrickGrid::of(volume.grid);
  VoxelBox around;
  std::uint64_t returned = 0, removed = 0;
  for (int left = bricks_per_tick(plan.rate_hz, !state.volumes[v].gradient.empty());
       left > 0 && rest.begin != rest.end && last().volume == v; --left) {
    const VoxelBox with = around.united(bricks.voxels(last().id));
    const VoxelIndex extent = with.extent();
    if (std::max({extent.x, extent.y, extent.z}) > kWidest) break;
    around = with;
    swap_brick(plan, last(), state, returned, removed);
    --rest.end;
  }
  out.returned_by_volume[volume.scene_index] = returned;
  out.removed_by_volume[volume.scene_index] = removed;
  out.removed_steps += removed;
  out.changed[volume.scene_index] = around;
}

}  // namespace kerf
