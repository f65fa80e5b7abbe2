// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/tool_pose.hpp"

namespace kerf {

/// The pose in plain integers, or none where no sample can be within a volume: kernels may then
/// count on 32-bit places.
struct NearPose {
  SamplePose pose{};
  bool near = false;
};

[[nodiscard]] inline NearPose near_pose(const ToolPose<FixedNumbers>& pose) noexcept {
  constexpr std::int32_t kFarthest = (kPositionLimitVox + kSampleReachVox) << Q16::kFractionBits;
  NearPose out;
  const Q16 centre[3] = {pose.centre_vox.x, pose.centre_vox.y, pose.centre_vox.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (centre[axis].raw() < -kFarthest || centre[axis].raw() > kFarthest) return out;
    out.pose.centre[axis] = centre[axis].raw();
    for (std::size_t k = 0; k < 3; ++k) out.pose.step[axis][k] = pose.step[axis][k];
  }
  out.near = true;
  return out;
}

/// `contact_sum` in the bits of the reference, whatever the kernels. `field` holds one gradient per
/// voxel and kFieldPad entries more. Work is bounded by the samples. Servo thread; no heap.
[[nodiscard]] inline SumVec<FixedNumbers> gathered_contact(
    const KernelSet& kernels, const SampleTable& samples, const VoxelGrid& grid,
    std::span<const Gradient<FixedNumbers>> field, const ToolPose<FixedNumbers>& pose) noexcept {
  const NearPose at = near_pose(pose);
  if (!at.near) return {};
  std::int64_t sum[3];
  kernels.gather(samples, at.pose, grid, &field.front().x, sum);
  return {sum[0], sum[1], sum[2]};
}

}  // namespace kerf
