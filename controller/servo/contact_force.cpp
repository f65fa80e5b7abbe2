// SPDX-License-Identifier: Apache-2.0

#include "controller/servo/contact_force.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/proxy.hpp"
#include "controller/servo/force_cut.hpp"
#include "controller/servo/method_step.hpp"
#include "controller/servo/volume_restore.hpp"

namespace kerf {
namespace {

/// A length in units, at the device port.
template <class N>
DeviceVec<typename N::Real> at_device(const ContactPlan<N>& contact,
                                      ContactVec<typename N::Real> units) noexcept {
  using Real = typename N::Real;
  const auto mm = [&](Real x) { return multiply<Real>(contact.device_mm_per_unit, x); };
  return {mm(units.x), mm(units.y), mm(units.z)};
}

/// The contact of one tick, by the queries for a tool with or without a shaft.
template <class N>
ProxyContact<N> follow_tool(const ServoPlan<N>& plan, const SweptTool<N>& tool,
                            ContactState<N>& state, const ProxyPose<N>& goal,
                            std::int64_t& queried) noexcept {
  const auto in_volumes = [&](const auto& volumes) {
    return std::span(volumes).first(plan.volume_count);
  };
  const auto with = [&](auto&& field) {
    field.begin_tick();
    const ProxyContact<N> felt = follow<N>(tool.proxy, state.proxy, field, goal);
    queried = field.spent();
    return felt;
  };
  if (tool.behind.count == 0) {
    return with(ContactQuery<N>(*plan.kernels, tool.point_shell, in_volumes(state.volumes)));
  }
  std::array<std::span<const ContactVolume<N>>, kMaxShaftParts> behind;
  std::ranges::transform(state.behind, behind.begin(), in_volumes);
  return with(ToolQuery<N>(*plan.kernels, tool.point_shell, in_volumes(state.volumes), tool.behind,
                           behind));
}

/// Lists the planes that bear a load, for a force of `force_n`.
template <class N>
void write_planes(const ContactPlan<N>& contact, const ProxyContact<N>& felt,
                  typename N::Real force_n, ToolContact<N>& tool) noexcept {
  using Real = typename N::Real;
  for (std::size_t i = 0; i < felt.planes.count; ++i) {
    if (felt.part[i] <= Real(0)) continue;
    const ConstraintPlane<N>& plane = felt.planes.plane[i];
    tool.planes[tool.plane_count++] = {relabel<DeviceSpace>(plane.normal),
                                       at_device(contact, plane.arm), felt.part[i] * force_n,
                                       plane.behind};
  }
}

/// Splits the force of the spring: friction is its part along the faces, across the press.
template <class N>
void split_spring(DeviceVec<typename N::Real> spring_n, const ProxyContact<N>& felt,
                  SweptForce<N>& out) noexcept {
  using Real = typename N::Real;
  out.spring_n = spring_n;
  const auto press = relabel<DeviceSpace>(felt.press);
  const Real pressed_n = multiply<Real>(press.x, spring_n.x) + multiply<Real>(press.y, spring_n.y) +
                         multiply<Real>(press.z, spring_n.z);
  if (!(pressed_n > Real(0))) return;
  out.spring_n = {multiply<Real>(press.x, pressed_n), multiply<Real>(press.y, pressed_n),
                  multiply<Real>(press.z, pressed_n)};
  out.friction_n = spring_n - out.spring_n;
}

}  // namespace

template <class N>
SweptForce<N> proxy_force(const ServoPlan<N>& plan, ServoState<N>& state,
                          WorldVec<typename N::Real> tip_mm, const Rotation<N>& rotation,
                          DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  using Real = typename N::Real;
  const ContactPlan<N>& contact = plan.contact;
  const SweptTool<N>& tool = plan.tools[state.active_tool].swept;
  const auto scaled = [](ContactVec<Real> v, typename N::Ratio by) {
    return ContactVec<Real>{multiply<Real>(by, v.x), multiply<Real>(by, v.y),
                            multiply<Real>(by, v.z)};
  };

  ProxyPose<N> goal;
  goal.centre = scaled(relabel<ContactSpace>(tip_mm - contact.origin_mm), contact.units_per_mm);
  if (tool.turned) goal.turn = orientation_of<N>(rotation.row);

  SweptForce<N> out;
  const ProxyContact<N> felt = follow_tool(plan, tool, state.contact, goal, out.queried);
  const auto spring_mm = at_device(contact, felt.spring);
  // The coupling is no law behind a pointer, so that the compiler inlines it.
  out.force_n = plan.force_law.given()
                    ? plan.force_law(state.force_law, {state.tip_mm, tip_mm, velocity_mm_per_s,
                                                       spring_mm, relabel<DeviceSpace>(felt.press)})
                    : virtual_coupling_force(contact.coupling, spring_mm, velocity_mm_per_s);
  // The force of a law has no other part.
  const bool whole =
      plan.force_law.given() || contact.coupling.damping_ns_per_mm == typename N::Unit{};
  const auto spring_n =
      whole ? out.force_n
            : virtual_coupling_force<N>({contact.coupling.stiffness_n_per_mm, {}}, spring_mm, {});
  if (tool.proxy.friction == typename N::Unit{}) {
    out.spring_n = spring_n;
  } else {
    split_spring(spring_n, felt, out);
  }
  out.offset_mm = relabel<WorldSpace>(scaled(felt.pose.centre - goal.centre, contact.mm_per_unit));
  out.tool.centre_mm =
      contact.origin_mm + relabel<WorldSpace>(scaled(felt.pose.centre, contact.mm_per_unit));
  if (tool.turned) out.tool.rotation = {rows_of(felt.pose.turn)};
  out.tool.normal = relabel<WorldSpace>(felt.normal);
  out.tool.press = relabel<WorldSpace>(felt.press);
  out.tool.head_fraction = felt.head_fraction;
  const Real force_n = norm(out.force_n);
  out.tool.head_arm_mm = at_device(contact, felt.head_arm);
  write_planes(contact, felt, force_n, out.tool);
  out.shaft_force_n = multiply<Real>(felt.shaft_fraction, force_n);
  out.torque_n_mm = at_device(contact, felt.moment_arm) * force_n;
  return out;
}

template <class N>
ToolForces<N> contact_and_cut(const ServoPlan<N>& plan, ServoState<N>& state,
                              WorldVec<typename N::Real> tip_mm, const Rotation<N>& rotation,
                              DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  ToolForces<N> forces;
  if (plan.contact.swept) {
    const SweptForce<N> felt = proxy_force(plan, state, tip_mm, rotation, velocity_mm_per_s);
    forces.contact_n = felt.force_n;
    forces.spring_n = felt.spring_n;
    forces.friction_n = felt.friction_n;
    forces.proxy_offset_mm = felt.offset_mm;
    forces.tip_torque_n_mm = felt.torque_n_mm;
    forces.tool = felt.tool;
    forces.shaft_force_n = felt.shaft_force_n;
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
        by_method<N>(tool.in_volume[v].method, [&](auto step) { return step.contact_and_cut(at); });
    forces.contact_n = forces.contact_n - in_volume.contact_n;
    forces.modification_n = forces.modification_n - in_volume.modification_n;
    forces.removed[plan.volumes[v].scene_index] = in_volume.removed;
  }
  if (!plan.contact.swept) forces.spring_n = forces.contact_n;
  return forces;
}

#define KERF_INSTANTIATE(N)                                                                      \
  template SweptForce<N> proxy_force(const ServoPlan<N>&, ServoState<N>&, WorldVec<N::Real>,     \
                                     const Rotation<N>&, DeviceVec<N::Real>) noexcept;           \
  template ToolForces<N> contact_and_cut(const ServoPlan<N>&, ServoState<N>&, WorldVec<N::Real>, \
                                         const Rotation<N>&, DeviceVec<N::Real>) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
