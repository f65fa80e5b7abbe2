// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/aligned.hpp"
#include "controller/kernel/contact.hpp"
#include "controller/kernel/gather.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/splat.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/servo/force_cut.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/swept_force.hpp"
#include "controller/servo/tool_contact.hpp"

namespace kerf {

/// Contact and modification at the device port, before any limit, and what was cut because of this
/// tick's pose. Where force cuts, the modification force is its friction, and the cut comes later.
template <class N>
struct ToolForces {
  DeviceVec<typename N::Real> contact_n;
  DeviceVec<typename N::Real> modification_n;
  WorldVec<typename N::Real> proxy_offset_mm;   ///< from the tip; 0 without a proxy
  DeviceVec<typename N::Real> tip_torque_n_mm;  ///< likewise
  ToolContact<N> tool;                          ///< likewise
  std::array<Removed, kMaxVolumes> removed{};   ///< by volume of the scene
};

/// One volume by the plan `aligned`: contact, then the modification force and the removal where
/// the plan cuts.
inline void feel_and_cut_aligned(const ServoPlan<FixedNumbers>& plan,
                                 ServoState<FixedNumbers>& state, std::size_t v,
                                 const ToolPose<FixedNumbers>& pose,
                                 ToolForces<FixedNumbers>& forces) noexcept {
  const VolumePlan<FixedNumbers>& volume = plan.volumes[v];
  VolumeState<FixedNumbers>& memory = state.volumes[v];
  const ToolInVolume<FixedNumbers>& in_volume = plan.tools[state.active_tool].in_volume[v];
  const AlignedTick tick(*plan.kernels, *in_volume.aligned, state.scratch.tick, volume.grid,
                         memory.density, pose);
  if (!plan.contact.swept) {
    forces.contact_n =
        forces.contact_n - force_of_sum<FixedNumbers>(in_volume.contact, tick.contact());
  }
  if (!plan.cutting) return;

  const AlignedTick::Milled milled = tick.mill(plan.removal_rate, memory.carry);
  forces.modification_n = forces.modification_n -
                          force_of_sum<FixedNumbers>(in_volume.modification, milled.modification);
  forces.removed[volume.scene_index] = milled.removed;
}

/// One volume by the plan `splat`: both forces, then the removal.
inline void feel_and_cut_splat(const ServoPlan<FixedNumbers>& plan, ServoState<FixedNumbers>& state,
                               std::size_t v, const ToolPose<FixedNumbers>& pose,
                               ToolForces<FixedNumbers>& forces) noexcept {
  const VolumePlan<FixedNumbers>& volume = plan.volumes[v];
  VolumeState<FixedNumbers>& memory = state.volumes[v];
  const ToolPlan<FixedNumbers>& tool = plan.tools[state.active_tool];
  const ToolInVolume<FixedNumbers>& in_volume = tool.in_volume[v];
  const SplatOutcome out =
      splat_tick(*plan.kernels, tool.samples, *plan.taps, state.scratch, volume.grid,
                 memory.density, pose, in_volume.overlap_ratio, plan.removal_rate, memory.carry);
  if (!plan.contact.swept) {
    forces.contact_n =
        forces.contact_n - force_of_sum<FixedNumbers>(in_volume.contact, out.felt.contact);
  }
  forces.modification_n = forces.modification_n -
                          force_of_sum<FixedNumbers>(in_volume.modification, out.felt.modification);
  forces.removed[volume.scene_index] = out.removed;
}

/// One volume from stored gradients. Fixed point gets here only where nothing is cut.
template <class N>
void feel_and_cut_gathered(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                           const ToolPose<N>& pose, ToolForces<N>& forces) noexcept {
  const VolumePlan<N>& volume = plan.volumes[v];
  VolumeState<N>& memory = state.volumes[v];
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  const ToolInVolume<N>& in_volume = tool.in_volume[v];
  const std::span<const Gradient<N>> gradient = memory.gradient;
  if constexpr (N::kIsFixed) {
    forces.contact_n =
        forces.contact_n -
        force_of_sum<N>(in_volume.contact,
                        gathered_contact(*plan.kernels, tool.samples, volume.grid, gradient, pose));
  } else {
    if (!plan.contact.swept) {
      forces.contact_n = forces.contact_n -
                         force_of_sum<N>(in_volume.contact,
                                         contact_sum<N>(volume.grid, gradient, tool.offsets, pose));
    }
    if (!plan.cutting) return;

    const VoxelBox touched =
        overlap<N>(volume.grid, tool.offsets, pose, in_volume.overlap_ratio, state.overlap);
    if (touched.empty()) return;
    forces.modification_n =
        forces.modification_n -
        force_of_sum<N>(in_volume.modification,
                        modification_sum<N>(volume.grid, gradient, memory.density, state.overlap));
    const Removed removed =
        remove<N>(volume.grid, memory.density, state.overlap, plan.removal_rate, memory.carry);
    refresh_gradients<N>(plan.kernel, volume.grid, memory.density, removed.changed, memory.gradient,
                         *state.gradient_scratch);
    forces.removed[volume.scene_index] = removed;
  }
}

/// Contact force of the active tool in all solid volumes as they are; then, where the plan cuts,
/// the modification force from the same densities, and only then the removal.
template <class N>
[[nodiscard]] ToolForces<N> feel_and_cut(const ServoPlan<N>& plan, ServoState<N>& state,
                                         WorldVec<typename N::Real> tip_mm,
                                         const Rotation<N>& rotation,
                                         DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  ToolForces<N> forces;
  if (plan.contact.swept) {
    const SweptForce<N> felt = feel_swept(plan, state, tip_mm, rotation, velocity_mm_per_s);
    forces.contact_n = felt.force_n;
    forces.proxy_offset_mm = felt.offset_mm;
    forces.tip_torque_n_mm = felt.torque_n_mm;
    forces.tool = felt.tool;
    if (plan.force_cut.on) forces.modification_n = felt_friction(plan, state, felt.tool);
    if (!plan.cutting) return forces;
  }
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const ToolPose<N> pose = tool_pose(plan.volumes[v], tool, tool.in_volume[v], tip_mm, rotation);
    if constexpr (N::kIsFixed) {
      if (tool.in_volume[v].plan == Plan::aligned) {
        feel_and_cut_aligned(plan, state, v, pose, forces);
        continue;
      }
      if (tool.in_volume[v].plan == Plan::splat) {
        feel_and_cut_splat(plan, state, v, pose, forces);
        continue;
      }
    }
    feel_and_cut_gathered(plan, state, v, pose, forces);
  }
  return forces;
}

}  // namespace kerf
