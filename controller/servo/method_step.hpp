// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/sampling.hpp"
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

/// The steps of the list. Each has a file of its own (as method_step.cpp), which defines the
/// members and instantiates the class for the numbers that it serves. Servo thread; no heap.
///
/// `feel_and_cut`: contact, where the paper's force is felt; then the modification force and the
/// removal, where overlap cuts. `cover`: what the tool covers, for a cut by force.
#define KERF_STEP(name, Step, serves)                                                    \
  template <class N>                                                                     \
  struct Step {                                                                          \
    [[nodiscard]] static VolumeForces<N> feel_and_cut(const VolumeTick<N>& at) noexcept; \
    [[nodiscard]] static Covered<N> cover(const VolumeTick<N>& at,                       \
                                          const CoverList<N>& list) noexcept;            \
  };
KERF_METHODS(KERF_STEP)
#undef KERF_STEP

/// Calls `work` with the step of a method. The servo's only choice between them: whatever it does
/// with a method it does through here.
template <class N, class Work>
decltype(auto) by_method(Method method, Work&& work) noexcept {
  switch (method) {
#define KERF_CASE(name, Step, serves)             \
  case Method::name:                              \
    if constexpr (serves) return work(Step<N>{}); \
    break;
    KERF_METHODS(KERF_CASE)
#undef KERF_CASE
  }
  return work(GatherStep<N>{});  // serves always
}

}  // namespace kerf
