// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/scene/gradient_plan.hpp"

namespace kerf {

/// Fills `gradients` for the voxels of `box` out of a whole volume, x fastest, with air around it.
/// The gradient of a voxel has the same bits whatever the box.
void fill_gradients(const GradientPlan& plan, const VoxelGrid& grid,
                    std::span<const Density> density, const VoxelBox& box,
                    std::vector<glm::vec3>& gradients);

}  // namespace kerf
