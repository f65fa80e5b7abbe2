// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/plan_cost.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

#include "controller/kernel/tick_box.hpp"
#include "controller/plan/covered_bound.hpp"
#include "controller/plan/turned_box.hpp"
#include "controller/scene/scene_words.hpp"

namespace kerf {
namespace {

constexpr std::uint64_t kPlace = 9, kCorners = 8;  ///< multiply-adds: three a component; one each

std::uint64_t count(std::int32_t n) {
  return static_cast<std::uint64_t>(n);
}

std::uint64_t voxels_of(VoxelIndex edges) {
  return count(edges.x) * count(edges.y) * count(edges.z);
}

/// Rows of a box's overlap.
std::uint64_t rows_of(VoxelIndex size) {
  return (count(size.y) + 1) * (count(size.z) + 1);
}

std::string variant_of(Plan plan, std::string_view runs_it) {
  return std::string(name_of(plan)) + "/" + std::string(runs_it);
}

std::uint64_t correlation_operations(const AlignedTable& table) {
  constexpr std::uint64_t kHalves = 2, kCorners = 8;
  const std::uint64_t axes = table.fused ? 3 : 1;
  std::uint64_t chunks = 0;
  for (const std::int32_t of_list : table.chunk_count) chunks += count(of_list);
  return chunks * count(table.lanes) * axes * kHalves * kCorners;
}

std::uint64_t ratios_of(const AlignedTable& table) {
  return rows_of(table.size) * count(table.row_lanes);
}

constexpr std::uint64_t kMasks = 8;  ///< of an entry of ratios: corners of a cell

std::uint64_t press_operations(const AlignedTable& table) {
  constexpr std::uint64_t kTapsX = 2 * 5, kTapsY = 3 * 5, kTapsZ = 2 * 5;
  constexpr std::uint64_t kProducts = 3;
  const std::uint64_t planes = count(table.size.z) + 1;
  const std::uint64_t filtered = planes * count(table.box.y) * count(table.row_lanes);
  return ratios_of(table) * (kMasks + kTapsX + kTapsY + kProducts) + filtered * kTapsZ;
}

/// Of every stage the most that it does in one of the boxes.
template <class StagesOf>
std::vector<StageCost> most_over(const std::vector<VoxelIndex>& sizes, StagesOf stages_of) {
  std::vector<StageCost> most = stages_of(sizes.front());
  for (const VoxelIndex& size : sizes) {
    const std::vector<StageCost> stages = stages_of(size);
    for (std::size_t s = 0; s < most.size(); ++s) {
      most[s].operations = std::max(most[s].operations, stages[s].operations);
    }
  }
  return most;
}

}  // namespace

PlanCost aligned_cost(const AlignedTable& table, const KernelSet& kernels, CutModel cut) {
  PlanCost cost{variant_of(Plan::aligned, kernels.name), {}};
  cost.stages = {{"copy", voxels_of(table.box)}, {"contact", correlation_operations(table)}};
  if (cut == CutModel::none) return cost;
  if (cut == CutModel::preston) {
    cost.stages.push_back({"cover", kMasks * ratios_of(table)});
    add_force_stages(most_groups(table), cost.stages);
    return cost;
  }
  cost.stages.push_back({"mill", press_operations(table) + ratios_of(table)});
  if (cut == CutModel::overlap_exact) {
    cost.stages.push_back({"bend", (count(table.size.x) + 1) * rows_of(table.size)});
  }
  return cost;
}

void add_force_stages(std::uint64_t covered, std::vector<StageCost>& stages) {
  stages.push_back({"list", covered});
  stages.push_back({"spend", covered});
}

std::vector<StageCost> splat_stages(std::uint64_t samples, VoxelIndex size, std::uint64_t touched,
                                    CutModel cut) {
  constexpr std::uint64_t kSplit = 3, kFilter = 5;
  const TickBox box = tick_box(size, kExactFarid, samples);
  const std::uint64_t lanes = count(box.row_lanes);
  std::vector<StageCost> stages{
      {"place", kPlace * samples}, {"copy", voxels_of(box.box)}, {"splat", kCorners * samples}};
  if (cut == CutModel::preston) {
    stages.push_back({"cover", lanes * rows_of(size)});
    return stages;
  }
  stages.push_back({"press", lanes * (kSplit * rows_of(size) + kFilter * touched)});
  if (cut == CutModel::overlap_exact) {
    stages.push_back({"bend", (count(size.x) + 1) * touched});
  }
  stages.push_back({"cut", lanes * touched});
  return stages;
}

PlanCost splat_cost(const KernelSet& kernels, const SceneTool& tool, const SceneVolume& volume,
                    CutModel cut) {
  PlanCost cost{variant_of(Plan::splat, kernels.name),
                most_over(box_sizes(tool, volume), [&](VoxelIndex size) {
                  return splat_stages(tool.offsets.size(), size, rows_of(size), cut);
                })};
  if (cut == CutModel::preston) add_force_stages(most_groups(tool, volume), cost.stages);
  return cost;
}

std::vector<StageCost> gather_stages(std::uint64_t samples, const std::optional<GatherBoxes>& boxes,
                                     CutModel cut) {
  constexpr std::uint64_t kSpread = 2 * kPlace + 2 * kCorners;
  std::vector<StageCost> stages{{"contact", kCorners * samples}};
  if (!boxes) return stages;
  stages.push_back({"overlap", kSpread * samples + boxes->overlap});
  if (cut == CutModel::preston) return stages;
  const bool bends = cut == CutModel::overlap_exact;
  stages.push_back({"modification", boxes->inside});
  stages.push_back({bends ? "bent removal" : "removal", boxes->inside});
  stages.push_back({"refresh", boxes->refreshed});
  return stages;
}

PlanCost gather_cost(NumericKind numeric, const KernelSet& kernels, const SceneTool& tool,
                     const SceneVolume& volume, CutModel cut) {
  const VoxelGrid& grid = volume.image.grid;
  const auto clipped = [&](VoxelIndex edges, std::int32_t beyond) {
    return voxels_of({std::min(edges.x, grid.nx + beyond), std::min(edges.y, grid.ny + beyond),
                      std::min(edges.z, grid.nz + beyond)});
  };
  const auto stages_of = [&](VoxelIndex size) {
    std::optional<GatherBoxes> boxes;
    if (cut != CutModel::none) {
      const VoxelIndex covered{size.x + 1, size.y + 1, size.z + 1};
      const VoxelIndex reached{size.x + kBoxMargin, size.y + kBoxMargin, size.z + kBoxMargin};
      boxes = {clipped(covered, 2), clipped(covered, 0), clipped(reached, 0)};
    }
    return gather_stages(tool.offsets.size(), boxes, cut);
  };
  PlanCost cost{
      variant_of(Plan::gather, numeric == NumericKind::fixed ? kernels.name : word_of(numeric)),
      most_over(box_sizes(tool, volume), stages_of)};
  if (cut == CutModel::preston) add_force_stages(most_covered(tool, volume), cost.stages);
  return cost;
}

PlanCost surface_cost(NumericKind numeric, const KernelSet& kernels) {
  return {
      variant_of(Plan::surface, numeric == NumericKind::fixed ? kernels.name : word_of(numeric)),
      {}};
}

void sweep_instead(std::uint64_t samples, std::vector<StageCost>& stages) {
  std::erase_if(stages,
                [](const StageCost& stage) { return std::string_view(stage.stage) == "contact"; });
  stages.insert(stages.begin(), {"probes", samples});
}

}  // namespace kerf
