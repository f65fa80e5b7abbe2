// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/force_cut.hpp"

#include <algorithm>

#include "controller/kernel/proxy/contact_math.hpp"
#include "controller/servo/method_step.hpp"
#include "controller/servo/press_shares.hpp"
#include "controller/servo/stroke.hpp"

namespace kerf {
namespace {

/// Axes of the spindle. A round tool has the same samples in every orientation, but turns about its
/// shaft; one whose shaft is felt is turned as that is.
template <class N>
const Rotation<N>& spindle_axes(const ToolPlan<N>& tool, const ServoState<N>& state,
                                const ToolContact<N>& at) noexcept {
  return tool.round && tool.turns && !tool.swept.turned ? state.rotation : at.rotation;
}

/// Deals a press of `cut.press_n` out over the volumes, by the part of it that each bears, cuts
/// them and returns the friction.
template <class N>
CuttingFriction<N> press_on_volumes(const ServoPlan<N>& plan, ServoState<N>& state,
                                    const ToolContact<N>& at, ForceCut<N>& cut) noexcept {
  using Real = typename N::Real;
  const ForceCutPlan<N>& rules = plan.force_cut;
  const Real advance_mm = multiply<Real>(plan.contact.mm_per_unit, state.force_cut.advance);
  const WorldVec<Real> centre_mm =
      at.centre_mm - relabel<WorldSpace>(times<N>(relabel<ContactSpace>(at.normal), advance_mm));
  CoveredVolumes<N> covered = cover_all(plan, state, centre_mm, at);

  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  const auto normal = transposed(spindle_axes(tool, state, at)) * at.normal;
  CuttingFriction<N> friction;
  const auto drive = cut_drive<N>(cut.press_n, rules.threshold_n, state.force_cut.spindle.ratio);
  bool starves = drive > 0 && !meets_press(plan, state, covered);
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    if (covered.in[v].list.empty() || !(covered.whole > 0)) continue;
    const PrestonPlan<N>& volume = rules.volume[v];
    cut.forbidden |= touched_forbidden(volume, covered.in[v]);
    const Real press_n =
        multiply<Real>(unit_share_of<N>(covered.borne[v], covered.whole), cut.press_n);
    if (drive > 0) keep_bricks(plan, state, v, place_in(plan.volumes[v], centre_mm));
    const SurfaceDrag<N>& drag = covered.in[v].drag;
    friction.add(rules.friction, press_n, tool.round ? ball_drag<N>(normal, drag.arm) : drag);
    const PrestonOutcome<N> out = cut_by_force(volume, drive, state.volumes[v].density,
                                               state.force_cut.volume[v], covered.in[v]);
    cut.removed[plan.volumes[v].scene_index] = out.removed;
    starves = starves || out.starves;
  }
  Real& advance = state.force_cut.advance;
  advance = std::clamp(starves ? advance + rules.deeper_step : advance - rules.back_step,
                       Real(kCutAdvance), Real(kDeepestAdvance));
  return friction;
}

}  // namespace

template <class N>
DeviceVec<typename N::Real> felt_friction(const ServoPlan<N>& plan, const ServoState<N>& state,
                                          const ToolContact<N>& at) noexcept {
  const Rotation<N>& axes = spindle_axes(plan.tools[state.active_tool], state, at);
  return relabel<DeviceSpace>(axes * state.force_cut.friction_n) * plan.workspace_scale;
}

template <class N>
Covered<N> cover(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                 WorldVec<typename N::Real> centre_mm, const ToolContact<N>& at) noexcept {
  const VolumePlan<N>& volume = plan.volumes[v];
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  const ToolInVolume<N>& in_volume = tool.in_volume[v];
  const VolumeTick<N> tick{plan, state, v,
                           tool_pose(volume, tool, in_volume, centre_mm, at.rotation)};
  const SpindleFrame<N> frame(tick.pose.centre_vox, in_volume.rims_from_voxel,
                              spindle_axes(tool, state, at));
  return by_method<N>(in_volume.method, [&](auto step) {
    return step.cover(tick, CoverList<N>{tick, frame});
  });
}

template <class N>
ForceCut<N> cut_by_sent_force(const ServoPlan<N>& plan, ServoState<N>& state,
                              const ToolContact<N>& at, DeviceVec<typename N::Real> sent_n,
                              bool runs) noexcept {
  using Real = typename N::Real;
  const ForceCutPlan<N>& rules = plan.force_cut;
  ForceCutState<N>& memory = state.force_cut;
  ForceCut<N> cut;
  const Real along_n = along<N>(relabel<ContactSpace>(at.press), relabel<ContactSpace>(sent_n));
  cut.press_n = std::max(Real(0), multiply<Real>(at.head_share, along_n) / plan.workspace_scale);
  CuttingFriction<N> friction;
  if (cut.press_n > Real(0)) friction = press_on_volumes(plan, state, at, cut);
  const bool turns = rules.spindle.free_ratio > typename N::Unit{};
  if (!turns) friction = {};
  turn_spindle(rules.spindle, runs, friction.torque_n_mm(plan.tools[state.active_tool].rim_mm),
               memory.spindle);
  follow_friction(rules.friction, friction.force_n(), memory.friction_n);
  return cut;
}

#define KERF_INSTANTIATE(N)                                                                      \
  template DeviceVec<N::Real> felt_friction(const ServoPlan<N>&, const ServoState<N>&,           \
                                            const ToolContact<N>&) noexcept;                     \
  template Covered<N> cover(const ServoPlan<N>&, ServoState<N>&, std::size_t, WorldVec<N::Real>, \
                            const ToolContact<N>&) noexcept;                                     \
  template ForceCut<N> cut_by_sent_force(const ServoPlan<N>&, ServoState<N>&,                    \
                                         const ToolContact<N>&, DeviceVec<N::Real>,              \
                                         bool) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(FloatNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
