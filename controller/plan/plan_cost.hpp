// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/scene_costs.hpp"

namespace kerf {

// One function a plan: its stages and the operations of each. Where force cuts, every plan ends
// otherwise:
//
//   cover  overlap ratios of all rows, as whole vectors of 32: multiply-adds of masks, 8 an entry;
//          in the plan `splat` entries that are scaled
//   list   groups of voxels that the tool covers (covered_bound.hpp), read with what they weigh;
//          voxel by voxel in the plan `gather`
//   spend  the same, from which the budget is taken; twice where the fullest have not enough
//
// Those come instead of `mill`, of all that follows `splat`, and of all that follows `overlap`.

/// Goes up when what counts as an operation changes: prices that were measured before are void.
inline constexpr int kCountsRevision = 8;

/// copy     voxels of the box around the tool
/// contact  multiply-adds of the correlation: table entries x 2 halves x 8 corners, chunk by chunk
/// mill     multiply-adds of masks, filters and products, and removals; rows as whole vectors of 32
/// bend     look-ups of `overlap_exact`: voxels that the tool covers
/// Reached in every tick in which the box meets the volume; the last two where no row of it is air.
[[nodiscard]] PlanCost aligned_cost(const AlignedTable& table, const KernelSet& kernels,
                                    CutModel cut);

/// place  multiply-adds of the samples' places, 9 a sample
/// copy   voxels of the box around the tool
/// splat  corners of the samples' cells: 8 a sample
/// press  3 an entry of all rows, which are split, and 5 more where the tool touches the row: those
///        are filtered. Rows are whole vectors of 32
/// bend   look-ups of `overlap_exact`: voxels of the rows that the tool touches
/// cut    entries of the rows that the tool touches
/// Bounded for every orientation that the tool can take; all rows count as touched. The box may be
/// larger than the volume: what sticks out is worked on as air.
[[nodiscard]] PlanCost splat_cost(const KernelSet& kernels, const SceneTool& tool,
                                  const SceneVolume& volume, CutModel cut);

/// Its stages where the box is known; `size` as in TickBox, `touched` counts rows.
[[nodiscard]] std::vector<StageCost> splat_stages(std::uint64_t samples, VoxelIndex size,
                                                  std::uint64_t touched, CutModel cut);

/// contact       corners of the samples' cells: 8 a sample
/// overlap       multiply-adds of a sample's place (twice), its weights and its sums, 34 a sample;
///               and voxels of the box that the tool covers
/// modification  voxels of that box
/// removal       voxels of that box; `bent removal` with the look-ups of `overlap_exact`
/// refresh       voxels of the box grown by the gradient's reach
/// The box is bounded likewise; of what sticks out of the volume only `overlap` sees one voxel at
/// each end. Fixed point gathers only where nothing is cut.
[[nodiscard]] PlanCost gather_cost(NumericKind numeric, const KernelSet& kernels,
                                   const SceneTool& tool, const SceneVolume& volume, CutModel cut);

/// The plan `surface` does nothing of its own.
[[nodiscard]] PlanCost surface_cost(NumericKind numeric, const KernelSet& kernels);

/// Where force cuts, after all else: `list` and `spend` of so many covered groups or voxels.
inline constexpr std::size_t kForceStages = 2;
void add_force_stages(std::uint64_t covered, std::vector<StageCost>& stages);

/// Where the swept proxy is felt: instead of `contact`, before all else,
/// probes  samples that are read, and what is counted like them: a volume's share of what a tick
///         may spend in all of them (query_work.hpp)
void sweep_instead(std::uint64_t samples, std::vector<StageCost>& stages);

/// Voxels that the stages of `gather` work on.
struct GatherBoxes {
  std::uint64_t overlap = 0, inside = 0, refreshed = 0;
};

/// Its stages where the boxes are known; without them where nothing is cut.
[[nodiscard]] std::vector<StageCost> gather_stages(std::uint64_t samples,
                                                   const std::optional<GatherBoxes>& boxes,
                                                   CutModel cut);

}  // namespace kerf
