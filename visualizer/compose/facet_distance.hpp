// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "shared/volume/voxel_grid.hpp"
#include "visualizer/view/scene_view.hpp"

namespace kerf {

/// Where the points of a cubic grid stand beside a body.
struct GridPlaces {
  VoxelGrid grid;
  glm::dvec3 first_mm;
  double edge_mm;
};

/// Signed distance of every point to the surface of a closed mesh, mm, negative inside; +-reach_mm
/// where it is more. Inside is where the mesh winds around a point. x fastest.
[[nodiscard]] std::vector<float> facet_distances(const Facets& facets, const GridPlaces& places,
                                                 double reach_mm);

}  // namespace kerf
