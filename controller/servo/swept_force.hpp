// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/tool_contact.hpp"

namespace kerf {

/// What the swept proxy gives the hand.
template <class N>
struct SweptForce {
  DeviceVec<typename N::Real> force_n;      ///< of the coupling, before any limit
  WorldVec<typename N::Real> offset_mm;     ///< from the hand's tip to the proxy's
  DeviceVec<typename N::Real> torque_n_mm;  ///< of the contact about the tool's centre
  ToolContact<N> tool;
  std::int64_t queried = 0;  ///< samples that it took, as query_work.hpp counts
};

/// One tick: the proxy of the active tool follows the hand, the coupling pulls the hand to the
/// proxy (docs/theory.md 4, 5.1). `rotation` turns the tool, unless it is round or keeps the
/// world's axes. Servo thread; at most 32 queries; writes only `state.contact`.
template <class N>
[[nodiscard]] SweptForce<N> feel_swept(const ServoPlan<N>& plan, ServoState<N>& state,
                                       WorldVec<typename N::Real> tip_mm,
                                       const Rotation<N>& rotation,
                                       DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  using Real = typename N::Real;
  const ContactPlan<N>& contact = plan.contact;
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  const auto scaled = [](ContactVec<Real> v, typename N::Ratio by) {
    return ContactVec<Real>{multiply<Real>(by, v.x), multiply<Real>(by, v.y),
                            multiply<Real>(by, v.z)};
  };

  ProxyPose<N> goal;
  goal.centre = scaled(relabel<ContactSpace>(tip_mm - contact.origin_mm), contact.units_per_mm);
  if (tool.turns && !tool.round) goal.turn = turn_of<N>(rotation.row);
  ContactQuery<N> field(*plan.kernels, tool.swept.point_shell,
                        std::span(state.contact.volumes).first(plan.volume_count));
  field.begin_tick();
  const ProxyContact<N> felt = follow<N>(tool.swept.proxy, state.contact.proxy, field, goal);

  SweptForce<N> out;
  out.force_n = coupling_force(
      contact.coupling, relabel<DeviceSpace>(scaled(felt.spring, contact.device_mm_per_unit)),
      velocity_mm_per_s);
  out.offset_mm = relabel<WorldSpace>(scaled(felt.pose.centre - goal.centre, contact.mm_per_unit));
  out.tool.centre_mm =
      contact.origin_mm + relabel<WorldSpace>(scaled(felt.pose.centre, contact.mm_per_unit));
  if (tool.turns && !tool.round) out.tool.rotation = {rows_of(felt.pose.turn)};
  out.tool.normal = relabel<WorldSpace>(felt.normal);
  out.torque_n_mm =
      relabel<DeviceSpace>(scaled(felt.moment_arm, contact.device_mm_per_unit)) * norm(out.force_n);
  out.queried = field.spent();
  return out;
}

}  // namespace kerf
