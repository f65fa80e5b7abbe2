// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/tool_pose.hpp"
#include "controller/servo/plain_numbers.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/volume_reset.hpp"
#include "shared/volume/brick_grid.hpp"

// The last stroke can be undone: every brick is kept as it was before the stroke's first cut in it.
// Who is about to cut says which bricks it may reach; what was kept so and then not cut belongs to
// the stroke that begins next, since nothing changed it. Servo thread; no heap.

namespace kerf {

/// Bricks of a pool that a stroke may take; the others are for what may be cut next.
[[nodiscard]] constexpr std::size_t stroke_room(std::size_t pool) noexcept {
  return pool - pool / 4;
}

/// Keeps the bricks around a tool at `centre_vox`, each once a stroke. Copies at most the bricks of
/// the tool's box, of which the cut that follows weighs every voxel. Where the pool is full, the
/// stroke cannot be undone.
template <class N>
void keep_bricks(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                 const VoxelVec<typename N::Real>& centre_vox) noexcept {
  const VoxelGrid& grid = plan.volumes[v].grid;
  const std::array<std::int32_t, 3>& reach = plan.tools[state.active_tool].in_volume[v].reach_vox;
  StrokeState& stroke = state.stroke;
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
        const bool full = stroke.open ? stroke.end - stroke.begin >= stroke_room(stroke.pool.size())
                                      : stroke.end - stroke.begin >= stroke.pool.size();
        if (full) {
          (stroke.open ? stroke.lost : stroke.next_lost) = true;
          return;
        }
        KeptBrick& kept = stroke.pool[stroke.end++ % stroke.pool.size()];
        kept_in = stroke.generation;
        kept.volume = static_cast<std::uint32_t>(v);
        kept.id = id;
        const VoxelBox box = bricks.voxels(id);
        const auto row = static_cast<std::size_t>(box.hi.x - box.lo.x);
        std::size_t to = 0;
        for (std::int32_t k = box.lo.z; k < box.hi.z; ++k) {
          for (std::int32_t j = box.lo.y; j < box.hi.y; ++j, to += row) {
            copy_row(&kept.density[to], &state.volumes[v].density[grid.index(box.lo.x, j, k)], row);
          }
        }
      }
    }
  }
}

/// What is kept from now on belongs to the next stroke.
inline void close_stroke(StrokeState& stroke) noexcept {
  stroke.open = false;
  stroke.next = stroke.end;
  ++stroke.generation;
}

/// Forgets what was kept for the next stroke.
inline void forget_next(StrokeState& stroke) noexcept {
  stroke.end = stroke.next;
  stroke.next_lost = false;
  ++stroke.generation;
}

/// Forgets all: the volumes are about to change otherwise.
inline void forget_strokes(StrokeState& stroke) noexcept {
  close_stroke(stroke);
  stroke.begin = stroke.end;
  stroke.lost = stroke.next_lost = false;
}

/// At the end of a tick that did not restore: a cut begins a stroke or goes on with it, and a pause
/// without contact ends it.
inline void follow_stroke(std::uint32_t pause_ticks, bool cuts, bool touches,
                          StrokeState& stroke) noexcept {
  if (cuts && !stroke.open) {
    stroke.open = true;
    stroke.begin = stroke.next;
    stroke.lost = stroke.next_lost;
    stroke.next_lost = false;
    stroke.quiet_ticks = 0;
  }
  if (!stroke.open) {
    if (stroke.next_lost) forget_next(stroke);
    return;
  }
  stroke.quiet_ticks = cuts || touches ? 0 : stroke.quiet_ticks + 1;
  if (stroke.quiet_ticks >= pause_ticks) close_stroke(stroke);
}

/// Begins to undo the last stroke, also one that is not over. False where there is none, or it was
/// too long.
inline bool begin_undo(StrokeState& stroke) noexcept {
  if (!stroke.can_undo()) return false;
  if (stroke.open) {
    close_stroke(stroke);
  } else {
    forget_next(stroke);
  }
  stroke.undoing = true;
  return true;
}

/// Puts one brick back. Returns its box; adds what came back to `returned`.
template <class N>
VoxelBox put_back(const ServoPlan<N>& plan, const KeptBrick& kept, ServoState<N>& state,
                  std::uint64_t& returned) noexcept {
  const VoxelGrid& grid = plan.volumes[kept.volume].grid;
  VolumeState<N>& volume = state.volumes[kept.volume];
  const VoxelBox box = BrickGrid::of(grid).voxels(kept.id);
  const auto row = static_cast<std::size_t>(box.hi.x - box.lo.x);
  std::size_t from = 0;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y, from += row) {
      Density* const to = &volume.density[grid.index(box.lo.x, y, z)];
      for (std::size_t i = 0; i < row; ++i) {
        returned += static_cast<std::uint64_t>(kept.density[from + i] - to[i]);
      }
      copy_row(to, &kept.density[from], row);
    }
  }
  if (!volume.gradient.empty()) {
    refresh_gradients<N>(plan.kernel, grid, volume.density, box, volume.gradient,
                         *state.gradient_scratch);
  }
  return box;
}

/// One tick of an undo that runs: some bricks of one volume that lie close to each other, told in
/// `out`. The last tick ends it.
template <class N>
void undo_some(const ServoPlan<N>& plan, ServoState<N>& state, ServoOutput& out) noexcept {
  constexpr std::int32_t kWidest = BrickBlocks::kEdge * kBrickEdge;  // as a block of a reset
  StrokeState& stroke = state.stroke;
  if (stroke.begin == stroke.end) {
    stroke.undoing = false;
    for (std::size_t v = 0; v < plan.volume_count; ++v) forget_debts(state, v);
    end_restoring(state);
    return;
  }
  const auto last = [&]() -> const KeptBrick& {
    return stroke.pool[(stroke.end - 1) % stroke.pool.size()];
  };
  const std::uint32_t v = last().volume;
  const VolumePlan<N>& volume = plan.volumes[v];
  const BrickGrid bricks = BrickGrid::of(volume.grid);
  VoxelBox around;
  for (int left = bricks_per_tick(plan.rate_hz, !state.volumes[v].gradient.empty());
       left > 0 && stroke.begin != stroke.end && last().volume == v; --left) {
    const VoxelBox with = around.united(bricks.voxels(last().id));
    const VoxelIndex extent = with.extent();
    if (std::max({extent.x, extent.y, extent.z}) > kWidest) break;
    around = with;
    put_back(plan, last(), state, out.returned_by_volume[volume.scene_index]);
    stroke.next = --stroke.end;
  }
  out.changed[volume.scene_index] = around;
}

}  // namespace kerf
