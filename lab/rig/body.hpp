// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lab/rig/points.hpp"
#include "shared/volume/voxel_grid.hpp"

/// Solids of known shape as volumes whose voxels are units, the first at the origin.
namespace kerf::extremes {

/// A volume of densities, and its size.
struct Body {
  VoxelGrid grid;
  std::vector<Density> density;
};

/// Density of every voxel from a function of its indices.
template <class DensityAt>
[[nodiscard]] Body made_of(VoxelGrid grid, DensityAt&& density_at) {
  Body body{grid, {}};
  body.density.reserve(grid.voxel_count());
  for (std::int32_t z = 0; z < grid.nz; ++z) {
    for (std::int32_t y = 0; y < grid.ny; ++y) {
      for (std::int32_t x = 0; x < grid.nx; ++x) body.density.push_back(density_at(x, y, z));
    }
  }
  return body;
}

/// Share 0..1 of full density by place, clipped; the iso-surface is at 1/2.
template <class Share>
[[nodiscard]] Body body_of(VoxelGrid grid, Share&& share_at) {
  return made_of(grid, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    const double share = share_at(Point{double(x), double(y), double(z)});
    return static_cast<Density>(std::lround(kDensityMax * std::clamp(share, 0.0, 1.0)));
  });
}

/// From a signed distance, negative inside; density rises over `edge` voxels.
template <class Distance>
[[nodiscard]] Body blurred(VoxelGrid grid, Distance&& distance, double edge = 2) {
  return body_of(grid, [&](Point p) { return 0.5 - distance(p) / edge; });
}

}  // namespace kerf::extremes
