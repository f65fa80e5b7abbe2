// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/sampling.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

// One tick of one volume by one of the methods.

namespace kerf {

/// The active tool in volume `v` of the plan, in one tick: the argument of each step.
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
  /// Whether overlap removes material in this tick. False while the pedal is up.
  [[nodiscard]] bool overlap_cuts() const noexcept { return plan.overlap_cuts && state.pedal_down; }
};

/// The forces of one volume at the device port, and the removal in it. The forces point along the
/// gradient; the hand gets their negative.
template <class N>
struct VolumeForces {
  DeviceVec<typename N::Real> contact_n, modification_n;
  Removed removed;
};

/// Lists the voxels that the overlap of a step covers, for a cut by force.
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

/// The steps of the methods; method_step.cpp instantiates each for the number types that it
/// supports. Servo thread; no heap.
///
/// `contact_and_cut` computes the contact force, unless the proxy does; then, if overlap cuts, the
/// modification force and the removal. `cover` lists the covered voxels, for a cut by force.
#define KERF_STEP(name, Step, serves)                                                       \
  template <class N>                                                                        \
  struct Step {                                                                             \
    [[nodiscard]] static VolumeForces<N> contact_and_cut(const VolumeTick<N>& at) noexcept; \
    [[nodiscard]] static Covered<N> cover(const VolumeTick<N>& at,                          \
                                          const CoverList<N>& list) noexcept;               \
  };
KERF_METHODS(KERF_STEP)
#undef KERF_STEP

/// Calls `work` with the step of a method: the only switch over methods in the servo.
template <class N, class Work>
decltype(auto) by_method(Method method, Work&& work) noexcept {
  switch (method) {
// NOLINTBEGIN(bugprone-macro-parentheses,bugprone-branch-clone): a template's name; cases without
// support for N
#define KERF_CASE(name, Step, serves)             \
  case Method::name:                              \
    if constexpr (serves) return work(Step<N>{}); \
    break;
    KERF_METHODS(KERF_CASE)
#undef KERF_CASE
    // NOLINTEND(bugprone-macro-parentheses,bugprone-branch-clone)
  }
  return work(GatherStep<N>{});  // supports all number types
}

}  // namespace kerf
