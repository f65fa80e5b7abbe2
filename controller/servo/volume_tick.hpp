// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/kernel/covered_groups.hpp"
#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// The active tool in volume `v` of the plan, in one tick: what the step of a method is given.
template <class N>
struct VolumeTick {
  const ServoPlan<N>& plan;
  ServoState<N>& state;
  std::size_t v;
  ToolPose<N> pose;

  [[nodiscard]] const ToolPlan<N>& tool() const noexcept { return plan.tools[state.active_tool]; }
  [[nodiscard]] const ToolInVolume<N>& in_volume() const noexcept { return tool().in_volume[v]; }
  [[nodiscard]] const VoxelGrid& grid() const noexcept { return plan.volumes[v].grid; }
  [[nodiscard]] VolumeState<N>& memory() const noexcept { return state.volumes[v]; }
};

/// What one volume does to the tool, at the device port and along the gradient, so that the hand
/// feels its negative; and what the tool cut of it.
template <class N>
struct VolumeForces {
  DeviceVec<typename N::Real> contact_n, modification_n;
  Removed removed;
};

/// Lists what a step's overlap covers, for a cut by force.
template <class N>
struct CoverList {
  const VolumeTick<N>& at;
  const SpindleFrame<N>& frame;

  /// `overlap`: a BoxOverlap in fixed point, else an OverlapBox.
  [[nodiscard]] Covered<N> operator()(const auto& overlap) const noexcept {
    const std::span<const Label> labels = at.plan.force_cut.volume[at.v].labels;
    const std::span<CoveredEntry<N>> memory = at.state.force_cut.list[at.v];
    if constexpr (N::kIsFixed) {
      return covered_groups(*at.plan.kernels, at.grid(), labels, overlap, frame, memory);
    } else {
      return covered_voxels<N>(at.grid(), std::span<const Density>(at.memory().density), labels,
                               overlap, frame, memory);
    }
  }
};

}  // namespace kerf
