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

/// The contact of one tick.
template <class N>
ProxyContact<N> follow_tool(const ServoPlan<N>& plan, const SweptTool<N>& tool,
                            ContactState<N>& state, const ProxyPose<N>& goal,
                            std::int64_t& samples_read) noexcept {
  const auto in_volumes = [&](const auto& volumes) {
    return std::span(volumes).first(plan.volume_count);
  };
  std::array<std::span<const ContactVolume<N>>, kMaxShaftParts> shaft_volumes;
  std::ranges::transform(state.shaft_volumes, shaft_volumes.begin(), in_volumes);
  ContactQuery<N> field(*plan.kernels, tool.point_shell, in_volumes(state.volumes), tool.shaft,
                        shaft_volumes);
  field.begin_tick();
  const ProxyContact<N> contact = follow<N>(tool.proxy, state.proxy, field, goal);
  samples_read = field.spent();
  return contact;
}

/// Lists the planes that bear a load, for a force of `force_n`.
template <class N>
void list_planes(const ContactPlan<N>& contact, const ProxyContact<N>& proxy,
                 typename N::Real force_n, ContactResult<N>& out) noexcept {
  using Real = typename N::Real;
  static_assert(kMaxPlaneLoads == kMaxPlanes);
  for (std::size_t i = 0; i < proxy.planes.count; ++i) {
    if (proxy.part[i] <= Real(0)) continue;
    const ConstraintPlane<N>& plane = proxy.planes.plane[i];
    out.planes[out.plane_count++] = {relabel<DeviceSpace>(plane.normal),
                                     at_device(contact, plane.lever), proxy.part[i] * force_n,
                                     plane.on_shaft};
  }
}

/// Splits the force of the spring: friction is its part along the faces, across the press.
template <class N>
void split_spring(DeviceVec<typename N::Real> spring_n, const ProxyContact<N>& proxy,
                  ContactResult<N>& out) noexcept {
  using Real = typename N::Real;
  out.spring_n = spring_n;
  const auto press = relabel<DeviceSpace>(proxy.press);
  const Real pressed_n = multiply<Real>(press.x, spring_n.x) + multiply<Real>(press.y, spring_n.y) +
                         multiply<Real>(press.z, spring_n.z);
  if (!(pressed_n > Real(0))) return;
  out.spring_n = {multiply<Real>(press.x, pressed_n), multiply<Real>(press.y, pressed_n),
                  multiply<Real>(press.z, pressed_n)};
  out.friction_n = spring_n - out.spring_n;
}

}  // namespace

template <class N>
ContactResult<N> proxy_force(const ServoPlan<N>& plan, ServoState<N>& state,
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
  if (tool.follows_stylus) goal.orientation = orientation_of<N>(rotation.row);

  ContactResult<N> out;
  const ProxyContact<N> proxy = follow_tool(plan, tool, state.contact, goal, out.samples_read);
  const auto spring_mm = at_device(contact, proxy.spring);
  const LawForce<Real> force = plan.force_law(
      state.force_law,
      {state.tip_mm, tip_mm, velocity_mm_per_s, spring_mm, relabel<DeviceSpace>(proxy.press)});
  out.contact_n = force;
  out.law_failed = force.has_failed;
  if (tool.proxy.friction == typename N::Unit{}) {
    out.spring_n = force.spring_n;
  } else {
    split_spring(force.spring_n, proxy, out);
  }
  const Real force_n = norm(out.contact_n);
  out.proxy_offset_mm =
      relabel<WorldSpace>(scaled(proxy.pose.centre - goal.centre, contact.mm_per_unit));
  out.tip_torque_n_mm = at_device(contact, proxy.moment_arm) * force_n;
  out.shaft_force_n = multiply<Real>(proxy.shaft_fraction, force_n);
  out.centre_mm =
      contact.origin_mm + relabel<WorldSpace>(scaled(proxy.pose.centre, contact.mm_per_unit));
  if (tool.follows_stylus) out.rotation = {rows_of(proxy.pose.orientation)};
  out.normal = relabel<WorldSpace>(proxy.normal);
  out.press = relabel<WorldSpace>(proxy.press);
  out.head_fraction = proxy.head_fraction;
  out.head_lever_mm = at_device(contact, proxy.head_lever);
  list_planes(contact, proxy, force_n, out);
  return out;
}

template <class N>
ContactResult<N> contact_and_cut(const ServoPlan<N>& plan, ServoState<N>& state,
                                 WorldVec<typename N::Real> tip_mm, const Rotation<N>& rotation,
                                 DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  ContactResult<N> out;
  if (plan.contact.swept) {
    out = proxy_force(plan, state, tip_mm, rotation, velocity_mm_per_s);
    if (plan.force_cut.on) {
      out.modification_n = friction_of_last_cut(plan, state, out);
      out.tip_torque_n_mm = out.tip_torque_n_mm + cross(out.head_lever_mm, out.modification_n);
    }
    if (!plan.overlap_cuts) return out;
  }
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const VolumeTick<N> at{plan, state, v,
                           tool_pose(plan.volumes[v], tool, tool.in_volume[v], tip_mm, rotation)};
    if (at.overlap_cuts()) keep_bricks(plan, state, v, at.pose.centre_vox);
    const VolumeForces<N> in_volume =
        by_method<N>(tool.in_volume[v].method, [&](auto step) { return step.contact_and_cut(at); });
    out.contact_n = out.contact_n - in_volume.contact_n;
    out.modification_n = out.modification_n - in_volume.modification_n;
    out.removed[plan.volumes[v].scene_index] = in_volume.removed;
  }
  if (!plan.contact.swept) out.spring_n = out.contact_n;
  return out;
}

#define KERF_INSTANTIATE(N)                                                                     \
  template ContactResult<N> proxy_force(const ServoPlan<N>&, ServoState<N>&, WorldVec<N::Real>, \
                                        const Rotation<N>&, DeviceVec<N::Real>) noexcept;       \
  template ContactResult<N> contact_and_cut(const ServoPlan<N>&, ServoState<N>&,                \
                                            WorldVec<N::Real>, const Rotation<N>&,              \
                                            DeviceVec<N::Real>) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
