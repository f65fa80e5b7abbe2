// SPDX-License-Identifier: Apache-2.0

#include "controller/servo/force_cut.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "controller/servo/method_step.hpp"
#include "controller/servo/volume_restore.hpp"

namespace kerf {
namespace {

// The distribution of a press over the materials of all volumes (docs/forces.md 6.2).

/// The covered voxels of all volumes. Each `load` is a part of one `whole`.
template <class N>
struct CoveredVolumes {
  std::array<Covered<N>, kMaxVolumes> in{};
  std::array<CutWeight<N>, kMaxVolumes> borne{};  ///< load of each volume, of the whole
  CutWeight<N> whole{};
};

/// The load of each material, added up contact by contact.
template <class N>
class LoadDistribution {
 public:
  LoadDistribution(const ServoPlan<N>& plan, const ServoState<N>& state,
                   const CoveredVolumes<N>& covered) noexcept
      : plan_(plan), state_(state), covered_(covered) {}

  /// Adds a contact that bears `load_n`; `form_in(v)` is its form in volume v. Adds nothing if no
  /// voxel that reaches the iso lies at it.
  template <class FormIn>
  void add(typename N::Real load_n, FormIn&& form_in) noexcept {
    std::array<CoveredLoads<N>, kMaxVolumes> at;
    CutWeight<N> ahead{}, bearing{};
    for (std::size_t v = 0; v < plan_.volume_count; ++v) {
      at[v] = loads(covered_.in[v], form_in(v), state_.volumes[v].density, plan_.volumes[v].iso);
      for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
        ahead += at[v].ahead[m] = in_largest_voxels(at[v].ahead[m], v);
        bearing += at[v].bearing[m] = in_largest_voxels(at[v].bearing[m], v);
      }
    }
    if (!(bearing > 0)) return;
    whole_ += portion_of(load_n, bearing, bearing);
    for (std::size_t v = 0; v < plan_.volume_count; ++v) {
      for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
        if (at[v].bearing[m] > 0) borne_[v][m] += portion_of(load_n, at[v].bearing[m], bearing);
        if (at[v].ahead[m] > 0) ahead_[v][m] += portion_of(load_n, at[v].ahead[m], ahead);
      }
    }
  }

  [[nodiscard]] bool some() const noexcept { return whole_ > 0; }

  /// Distributes the press over the materials that bear a load. A material without load is removed
  /// as if it had its part of the weights at the contacts, so that it does not block the tool.
  void give(CoveredVolumes<N>& covered) const noexcept {
    covered.whole = whole_;
    for (std::size_t v = 0; v < plan_.volume_count; ++v) {
      covered.borne[v] = {};
      covered.in[v].whole = whole_;
      for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
        covered.borne[v] += borne_[v][m];
        covered.in[v].load[m] = borne_[v][m] > 0 ? borne_[v][m] : ahead_[v][m];
      }
    }
  }

  [[nodiscard]] CutWeight<N> in_largest_voxels(CutWeight<N> weight, std::size_t v) const noexcept {
    return static_cast<CutWeight<N>>(
        portion<N>(static_cast<CutBudget<N>>(weight), plan_.force_cut.voxel_fraction[v]));
  }

 private:
  /// load_n times part / whole. Fixed: 2^22 steps of the load times 2^30.
  [[nodiscard]] static CutWeight<N> portion_of(typename N::Real load_n, CutWeight<N> part,
                                               CutWeight<N> whole) noexcept {
    if constexpr (N::kIsFixed) {
      return static_cast<CutWeight<N>>(fraction_of<N>(part, whole)) *
             static_cast<CutWeight<N>>(load_n.raw());
    } else {
      return fraction_of<N>(part, whole) * load_n;
    }
  }

  const ServoPlan<N>& plan_;
  const ServoState<N>& state_;
  const CoveredVolumes<N>& covered_;
  std::array<ByMaterial<CutWeight<N>>, kMaxVolumes> ahead_{}, borne_{};
  CutWeight<N> whole_{};
};

/// Finds the loads with the centre of the cut at `centre_mm`: at the head's planes or, if no voxel
/// at them reaches the iso, over all covered voxels that do. Changes nothing if there are none.
template <class N>
void find_loads(const ServoPlan<N>& plan, const ServoState<N>& state,
                WorldVec<typename N::Real> centre_mm, const ContactResult<N>& at,
                CoveredVolumes<N>& covered) noexcept {
  using Real = typename N::Real;
  using Ratio = typename N::Ratio;
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  LoadDistribution<N> shares(plan, state, covered);
  for (std::size_t i = 0; i < at.plane_count; ++i) {
    const PlaneLoad<N>& plane = at.planes[i];
    if (plane.on_shaft) continue;
    const Real lever_mm =
        along<N>(relabel<ContactSpace>(plane.normal), relabel<ContactSpace>(plane.lever_mm)) *
        plan.workspace_scale;
    const LoadPlane<N> bears{relabel<WorldSpace>(plane.normal),
                             tool.round ? Ratio(-1) : Ratio(lever_mm / tool.rim_mm),
                             tool.steepness};
    shares.add(plane.load_n, [&](std::size_t v) {
      return contact_form<N>(voxel_position(plan.volumes[v], centre_mm),
                             tool.in_volume[v].rims_from_voxel, bears);
    });
  }
  if (!shares.some()) {
    shares.add(Real(1), [](std::size_t) { return everywhere<N>(); });
  }
  if (shares.some()) shares.give(covered);
}

/// Whether a covered voxel can be cut, or reaches the iso and bears a load. A softer one of a
/// forbidden material does neither.
template <class N>
[[nodiscard]] bool meets_press(const ServoPlan<N>& plan, const ServoState<N>& state,
                               const CoveredVolumes<N>& covered) noexcept {
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    if (covers_what_is_cut(plan.force_cut.volume[v], covered.in[v])) return true;
  }
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const CoveredLoads<N> at =
        loads(covered.in[v], everywhere<N>(), state.volumes[v].density, plan.volumes[v].iso);
    for (const CutWeight<N> bearing : at.bearing) {
      if (bearing > 0) return true;
    }
  }
  return false;
}

/// The covered voxels of all volumes with the centre of the cut at `centre_mm`.
template <class N>
[[nodiscard]] CoveredVolumes<N> cover_all(const ServoPlan<N>& plan, ServoState<N>& state,
                                          WorldVec<typename N::Real> centre_mm,
                                          const ContactResult<N>& at) noexcept {
  CoveredVolumes<N> covered;
  std::size_t materials = 0;
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    covered.in[v] = cover(plan, state, v, centre_mm, at);
    for (const CutWeight<N> weight : covered.in[v].weight) materials += weight > 0 ? 1 : 0;
  }
  const LoadDistribution<N> by_weight(plan, state, covered);
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    covered.borne[v] = by_weight.in_largest_voxels(covered.in[v].whole, v);
    covered.whole += covered.borne[v];
  }
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    for (CutWeight<N>& load : covered.in[v].load) load = by_weight.in_largest_voxels(load, v);
    covered.in[v].whole = covered.whole;
  }
  if (materials > 1) find_loads(plan, state, centre_mm, at, covered);
  return covered;
}

/// Axes of the spindle. A round tool has the same samples in every orientation, but rotates about
/// its shaft; if its shaft has contact, the orientation is that of the shaft.
template <class N>
const Rotation<N>& spindle_axes(const ToolPlan<N>& tool, const ServoState<N>& state,
                                const ContactResult<N>& at) noexcept {
  return tool.round && tool.turns && !tool.swept.follows_stylus ? state.rotation : at.rotation;
}

/// Distributes a press of `cut.normal_force_n` over the volumes by their loads, cuts them and
/// returns the friction.
template <class N>
CuttingFriction<N> press_on_volumes(const ServoPlan<N>& plan, ServoState<N>& state,
                                    const ContactResult<N>& at, ForceCut<N>& cut) noexcept {
  using Real = typename N::Real;
  const ForceCutPlan<N>& rules = plan.force_cut;
  const Real advance_mm = multiply<Real>(plan.contact.mm_per_unit, state.force_cut.advance);
  const WorldVec<Real> centre_mm =
      at.centre_mm - relabel<WorldSpace>(times<N>(relabel<ContactSpace>(at.normal), advance_mm));
  CoveredVolumes<N> covered = cover_all(plan, state, centre_mm, at);

  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  const auto normal = transposed(spindle_axes(tool, state, at)) * at.normal;
  CuttingFriction<N> friction;
  const auto ratio = state.pedal_down ? state.force_cut.spindle.ratio : typename N::Unit{};
  BurWear<N>& wear = state.force_cut.wear[state.active_tool];
  const auto sharp = cut_drive<N>(tool.law, cut.normal_force_n, ratio);
  const auto drive = wear.left_of(sharp, tool.law);
  if (covered.whole > 0) wear.add(sharp);
  bool starves = drive > 0 && !meets_press(plan, state, covered);
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    if (covered.in[v].list.empty() || !(covered.whole > 0)) continue;
    const PrestonPlan<N>& volume = rules.volume[v];
    cut.forbidden |= touched_forbidden(volume, covered.in[v]);
    const Real press_n =
        multiply<Real>(unit_fraction_of<N>(covered.borne[v], covered.whole), cut.normal_force_n);
    if (drive > 0) keep_bricks(plan, state, v, voxel_position(plan.volumes[v], centre_mm));
    const SurfaceDrag<N>& drag = covered.in[v].drag;
    friction.add(rules.friction, press_n,
                 tool.round ? ball_drag<N>(normal, drag.lever_ratio) : drag);
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
DeviceVec<typename N::Real> friction_of_last_cut(const ServoPlan<N>& plan,
                                                 const ServoState<N>& state,
                                                 const ContactResult<N>& at) noexcept {
  const Rotation<N>& axes = spindle_axes(plan.tools[state.active_tool], state, at);
  return relabel<DeviceSpace>(axes * state.force_cut.friction_n) * plan.workspace_scale;
}

template <class N>
Covered<N> cover(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                 WorldVec<typename N::Real> centre_mm, const ContactResult<N>& at) noexcept {
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
                              const ContactResult<N>& at, DeviceVec<typename N::Real> sent_n,
                              bool runs) noexcept {
  using Real = typename N::Real;
  const ForceCutPlan<N>& rules = plan.force_cut;
  ForceCutState<N>& memory = state.force_cut;
  ForceCut<N> cut;
  const Real along_n = along<N>(relabel<ContactSpace>(at.press), relabel<ContactSpace>(sent_n));
  cut.normal_force_n =
      std::max(Real(0), multiply<Real>(at.head_fraction, along_n) / plan.workspace_scale);
  CuttingFriction<N> friction;
  if (cut.normal_force_n > Real(0)) friction = press_on_volumes(plan, state, at, cut);
  const bool turns = rules.spindle.free_ratio > typename N::Unit{} && state.pedal_down;
  if (!turns) friction = {};
  turn_spindle(rules.spindle, runs, friction.torque_n_mm(plan.tools[state.active_tool].rim_mm),
               memory.spindle);
  follow_friction(rules.friction, friction.force_n(), memory.friction_n);
  return cut;
}

#define KERF_INSTANTIATE(N)                                                                      \
  template DeviceVec<N::Real> friction_of_last_cut(const ServoPlan<N>&, const ServoState<N>&,    \
                                                   const ContactResult<N>&) noexcept;            \
  template Covered<N> cover(const ServoPlan<N>&, ServoState<N>&, std::size_t, WorldVec<N::Real>, \
                            const ContactResult<N>&) noexcept;                                   \
  template ForceCut<N> cut_by_sent_force(const ServoPlan<N>&, ServoState<N>&,                    \
                                         const ContactResult<N>&, DeviceVec<N::Real>,            \
                                         bool) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
