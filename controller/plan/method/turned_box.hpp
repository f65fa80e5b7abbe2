// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Sizes of boxes, in low corners of cells as TickBox::size: in every orientation that the tool
/// takes in the volume, one of them holds the cells of all its samples. Load time.
///
/// Around the tool's axis the samples lie on rings of height y and radius r at most. With the axis
/// along the unit vector n the box spans, along axis i,
/// E_i = max(y n_i + r s_i) + max(-y n_i + r s_i), s_i = sqrt(1 - n_i^2), whatever the roll. A turn
/// by an angle changes E_i by no more than the tool's diameter times that angle, so a lattice of
/// directions stands for all. Without turning E_i is known.
[[nodiscard]] std::vector<VoxelIndex> box_sizes(const SceneTool& tool, const SceneVolume& volume);

}  // namespace kerf
