// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/close_sums.hpp"
#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/sets/point_places.hpp"
#include "controller/kernel/sets/sample_place.hpp"
#include "shared/volume/voxel_grid.hpp"

// A point shell's sums and densities, and the contact of the method `gather`, as the plain loops
// that define them: for sets that need no instruction that other machines lack. Internal linkage,
// for the reason given at KernelSet.

namespace kerf {
namespace {

void sum_point_samples(const PointTable<FixedNumbers>& table,
                       const PointPlaces<FixedNumbers>& places, const std::int32_t (&centre)[3],
                       const DensityField& field, PointSums<FixedNumbers>& sums) noexcept {
  sums = point_sums<FixedNumbers>(table, places, centre, field);
}

void read_point_samples(const PointPlaces<FixedNumbers>& places, std::int32_t count,
                        const std::int32_t (&centre)[3], const DensityField& field,
                        std::int32_t* density) noexcept {
  read_points<FixedNumbers>(places, count, centre, field, density);
}

void sum_close_samples(const CloseLook<FixedNumbers>& look,
                       CloseSums<FixedNumbers>& sums) noexcept {
  sums = close_sums<FixedNumbers>(look);
}

/// `contact_sum` of a field of three 16-bit parts a voxel.
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
