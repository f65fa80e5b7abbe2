// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_costs.hpp"

namespace kerf {

// One function a plan: its stages and the operations of each.

/// Goes up when what counts as an operation changes: prices that were measured before are void.
inline constexpr int kCountsRevision = 2;

/// copy     voxels of the box around the tool
/// contact  multiply-adds of the correlation: table entries x 2 halves x 8 corners, chunk by chunk
/// mill     multiply-adds of masks, filters and products, and removals; rows as whole vectors of 32
/// Reached in every tick in which the box meets the volume; `mill` where no row of it is air.
[[nodiscard]] PlanCost aligned_cost(const AlignedTable& table, const KernelSet& kernels, bool cuts);

/// place  multiply-adds of the samples' places, 9 a sample
/// copy   voxels of the box around the tool
/// splat  corners of the samples' cells: 8 a sample
/// press  voxels of that box, each filtered along three axes
/// cut    voxels that the tool covers
/// The boxes are bounded for every orientation that the tool can take.
[[nodiscard]] PlanCost splat_cost(const KernelSet& kernels, const SceneTool& tool,
                                  const SceneVolume& volume);

/// contact       corners of the samples' cells: 8 a sample
/// overlap       multiply-adds of a sample's place (twice), its weights and its sums, 34 a sample;
///               and voxels of the box that the tool covers
/// modification  voxels of that box
/// removal       voxels of that box
/// refresh       voxels of the box grown by the gradient's reach
/// The box is bounded likewise. Fixed point gathers only where nothing is cut.
[[nodiscard]] PlanCost gather_cost(NumericKind numeric, const KernelSet& kernels,
                                   const SceneTool& tool, const SceneVolume& volume, bool cuts);

/// Voxels of the largest box that the cells of the tool's samples can span, grown by `margin`
/// voxels along each axis (both ends together), and at most those of the volume.
///
/// The samples lie in a cylinder around the tool's y axis, of length L and diameter d, and in a
/// sphere of diameter D. With the axis along the unit vector n the cylinder spans
/// E_i = L |n_i| + d sqrt(1 - n_i^2) along axis i; by Cauchy and Schwarz SUM_i E_i is at most
/// sqrt(3) L + sqrt(6) d, and 3 D. A product of three is at most the cube of their mean. Without
/// turning E_i is known.
[[nodiscard]] std::uint64_t covered_voxels(const SceneTool& tool, const SceneVolume& volume,
                                           int margin);

}  // namespace kerf
