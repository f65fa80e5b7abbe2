// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "tests/kernel/definitions.hpp"
#include "tests/kernel/support.hpp"

namespace kerf::test {

/// `gradient_exact` of any voxel of a volume as it is now, made when it is first asked for: a tool
/// meets few of them. Zero where the volume does not reach.
class ExactField {
 public:
  ExactField(const ExactTaps& taps, TestVolume volume)
      : taps_(taps),
        volume_(std::move(volume)),
        grid_{volume_.grid.nx + 4, volume_.grid.ny + 4, volume_.grid.nz + 4},
        values_(grid_.voxel_count()) {}

  SumVec<FixedNumbers> operator()(VoxelIndex v) const {
    const VoxelIndex at{v.x + 2, v.y + 2, v.z + 2};
    if (!grid_.contains(at)) return {};
    auto& value = values_[grid_.index(at.x, at.y, at.z)];
    if (!value) value = gradient_exact(taps_, volume_.grid, volume_.density, v);
    return *value;
  }

 private:
  const ExactTaps& taps_;
  TestVolume volume_;
  VoxelGrid grid_;
  mutable std::vector<std::optional<SumVec<FixedNumbers>>> values_;
};

}  // namespace kerf::test
