// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "tests/kernel/definitions.hpp"
#include "tests/kernel/support.hpp"

namespace kerf::test {

/// `gradient_exact` of every voxel, and of those outside that the volume reaches.
class ExactField {
 public:
  ExactField(const ExactTaps& taps, const TestVolume& volume)
      : grid_{volume.grid.nx + 4, volume.grid.ny + 4, volume.grid.nz + 4} {
    values_.reserve(grid_.voxel_count());
    for (std::int32_t z = -2; z < volume.grid.nz + 2; ++z) {
      for (std::int32_t y = -2; y < volume.grid.ny + 2; ++y) {
        for (std::int32_t x = -2; x < volume.grid.nx + 2; ++x) {
          values_.push_back(gradient_exact(taps, volume.grid, volume.density, {x, y, z}));
        }
      }
    }
  }
  SumVec<FixedNumbers> operator()(VoxelIndex v) const {
    const VoxelIndex at{v.x + 2, v.y + 2, v.z + 2};
    return grid_.contains(at) ? values_[grid_.index(at.x, at.y, at.z)] : SumVec<FixedNumbers>{};
  }

 private:
  VoxelGrid grid_;
  std::vector<SumVec<FixedNumbers>> values_;
};

}  // namespace kerf::test
