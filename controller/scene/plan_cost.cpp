// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/plan_cost.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include "controller/kernel/gradient.hpp"
#include "controller/scene/lattice.hpp"
#include "controller/scene/scene_words.hpp"

namespace kerf {
namespace {

constexpr int kCellMargin = 3;  ///< floors at both ends, and the far corners of the last cells
constexpr std::uint64_t kPlace = 9, kCorners = 8;  ///< multiply-adds: three a component; one each

std::uint64_t count(std::int32_t n) {
  return static_cast<std::uint64_t>(n);
}

std::uint64_t correlation_operations(const AlignedTable& table) {
  constexpr std::uint64_t kHalves = 2, kCorners = 8;
  const std::uint64_t axes = table.fused ? 3 : 1;
  std::uint64_t chunks = 0;
  for (const std::int32_t of_list : table.chunk_count) chunks += count(of_list);
  return chunks * count(table.lanes) * axes * kHalves * kCorners;
}

std::uint64_t mill_operations(const AlignedTable& table) {
  constexpr std::uint64_t kMasks = 8;  // corners of a cell
  constexpr std::uint64_t kTapsX = 2 * 5, kTapsY = 3 * 5, kTapsZ = 2 * 5;
  constexpr std::uint64_t kProducts = 3, kRemovals = 1;
  const std::uint64_t planes = count(table.size.z) + 1;
  const std::uint64_t ratios = planes * (count(table.size.y) + 1) * count(table.row_lanes);
  const std::uint64_t filtered = planes * count(table.box.y) * count(table.row_lanes);
  return ratios * (kMasks + kTapsX + kTapsY + kProducts + kRemovals) + filtered * kTapsZ;
}

/// Mean of the spans along three axes at right angles, in pitches, in any orientation.
double largest_mean_span(std::span<const ToolOffset> offsets) {
  double across = 0, around = 0;   // largest distances from the axis and the centre, squared
  std::int16_t low = 0, high = 0;  // along the axis; the centre counts too
  for (const ToolOffset& offset : offsets) {
    const double x = offset[0], y = offset[1], z = offset[2];  // half pitches
    across = std::max(across, x * x + z * z);
    around = std::max(around, x * x + y * y + z * z);
    low = std::min(low, offset[1]);
    high = std::max(high, offset[1]);
  }
  const double cylinder =
      std::numbers::sqrt3 * (high - low) / 2.0 + std::sqrt(6.0) * std::sqrt(across);
  return std::min(cylinder, 3 * std::sqrt(around)) / 3;
}

}  // namespace

PlanCost aligned_cost(const AlignedTable& table, const KernelSet& kernels, bool cuts) {
  PlanCost cost{std::string("aligned/") + kernels.name, {}};
  cost.stages = {{"copy", count(table.box.x) * count(table.box.y) * count(table.box.z)},
                 {"contact", correlation_operations(table)}};
  if (cuts) cost.stages.push_back({"mill", mill_operations(table)});
  return cost;
}

PlanCost splat_cost(const KernelSet& kernels, const SceneTool& tool, const SceneVolume& volume) {
  const std::uint64_t samples = tool.offsets.size();
  const std::uint64_t box = covered_voxels(tool, volume, kCellMargin + 2 * kGradientReach);
  return {std::string("splat/") + kernels.name,
          {{"place", kPlace * samples},
           {"copy", box},
           {"splat", kCorners * samples},
           {"press", box},
           {"cut", covered_voxels(tool, volume, kCellMargin)}}};
}

PlanCost gather_cost(NumericKind numeric, const KernelSet& kernels, const SceneTool& tool,
                     const SceneVolume& volume, bool cuts) {
  constexpr std::uint64_t kSpread = 2 * kPlace + 2 * kCorners;
  const std::uint64_t samples = tool.offsets.size();
  PlanCost cost{
      "gather/" + std::string(numeric == NumericKind::fixed ? kernels.name : word_of(numeric)),
      {{"contact", kCorners * samples}}};
  if (!cuts) return cost;
  const std::uint64_t covered = covered_voxels(tool, volume, kCellMargin);
  cost.stages.push_back({"overlap", kSpread * samples + covered});
  cost.stages.push_back({"modification", covered});
  cost.stages.push_back({"removal", covered});
  cost.stages.push_back(
      {"refresh", covered_voxels(tool, volume, kCellMargin + 2 * kGradientReach)});
  return cost;
}

std::uint64_t covered_voxels(const SceneTool& tool, const SceneVolume& volume, int margin) {
  const auto& h = volume.image.spacing_mm;
  double voxels = 1;
  if (tool.round || !tool.turns) {
    const Matrix steps = unturned_steps(tool, volume);
    for (const auto& row : steps) {
      double edge = margin;
      for (std::size_t j = 0; j < 3; ++j) edge += std::abs(row[j]) * (tool.size_vox[j] - 1);
      voxels *= std::floor(edge + 1e-6);  // rounding of the steps must not lose a voxel
    }
  } else {
    double mean = largest_mean_span(tool.offsets);
    for (const double mm : h) mean += margin * mm / tool.pitch_mm / 3;
    for (const double mm : h) voxels *= mean * tool.pitch_mm / mm;
  }
  return std::min(static_cast<std::uint64_t>(std::ceil(voxels)),
                  std::uint64_t{volume.image.grid.voxel_count()});
}

}  // namespace kerf
