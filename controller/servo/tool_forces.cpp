// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/tool_forces.hpp"

#include <cstddef>

#include "controller/servo/force_cut.hpp"
#include "controller/servo/method_step.hpp"
#include "controller/servo/stroke.hpp"
#include "controller/servo/swept_force.hpp"

namespace kerf {

template <class N>
ToolForces<N> feel_and_cut(const ServoPlan<N>& plan, ServoState<N>& state,
                           WorldVec<typename N::Real> tip_mm, const Rotation<N>& rotation,
                           DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  ToolForces<N> forces;
  if (plan.contact.swept) {
    const SweptForce<N> felt = feel_swept(plan, state, tip_mm, rotation, velocity_mm_per_s);
    forces.contact_n = felt.force_n;
    forces.spring_n = felt.spring_n;
    forces.friction_n = felt.friction_n;
    forces.proxy_offset_mm = felt.offset_mm;
    forces.tip_torque_n_mm = felt.torque_n_mm;
    forces.tool = felt.tool;
    forces.behind_n = felt.behind_n;
    forces.queried = felt.queried;
    if (plan.force_cut.on) {
      forces.modification_n = felt_friction(plan, state, felt.tool);
      forces.tip_torque_n_mm =
          forces.tip_torque_n_mm + cross(felt.tool.head_arm_mm, forces.modification_n);
    }
    if (!plan.cutting) return forces;
  }
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const VolumeTick<N> at{plan, state, v,
                           tool_pose(plan.volumes[v], tool, tool.in_volume[v], tip_mm, rotation)};
    if (plan.cutting) keep_bricks(plan, state, v, at.pose.centre_vox);
    const VolumeForces<N> in_volume =
        by_method<N>(tool.in_volume[v].method, [&](auto step) { return step.feel_and_cut(at); });
    forces.contact_n = forces.contact_n - in_volume.contact_n;
    forces.modification_n = forces.modification_n - in_volume.modification_n;
    forces.removed[plan.volumes[v].scene_index] = in_volume.removed;
  }
  if (!plan.contact.swept) forces.spring_n = forces.contact_n;
  return forces;
}

#define KERF_INSTANTIATE(N)                                                                   \
  template ToolForces<N> feel_and_cut(const ServoPlan<N>&, ServoState<N>&, WorldVec<N::Real>, \
                                      const Rotation<N>&, DeviceVec<N::Real>) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(FloatNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
