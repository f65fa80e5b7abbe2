// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/sets/sample_place.hpp"
#include "shared/volume/voxel_grid.hpp"

// Contact of the method `gather` as plain loops; internal linkage, for the reason given at
// KernelSet.

namespace kerf {
namespace {

void gather(const SampleTable& samples, const SamplePose& pose, const VoxelGrid& grid,
            const std::int16_t* field, std::int64_t (&sum)[3]) noexcept {
  sum[0] = sum[1] = sum[2] = 0;
  for (std::int32_t first = 0; first < samples.count; first += kSampleGroup) {
    std::int32_t place[3][kSampleGroup];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place_along(samples, first, pose.centre[axis], pose.step[axis], place[axis]);
    }
    SampleCells cells;
    find_cells(place[0], place[1], place[2], cells);
    for (std::int32_t i = 0; i < kSampleGroup && first + i < samples.count; ++i) {
      const VoxelIndex low{cells.low[0][i], cells.low[1][i], cells.low[2][i]};
      if (!grid.contains(low) || !grid.contains({low.x + 1, low.y + 1, low.z + 1})) continue;
      for (std::int32_t c = 0; c < 8; ++c) {
        const std::int16_t* g =
            field + 3 * grid.index(low.x + (c & 1), low.y + (c >> 1 & 1), low.z + (c >> 2));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          sum[axis] += cells.weight[c][i] * g[axis];
        }
      }
    }
  }
}

}  // namespace
}  // namespace kerf
