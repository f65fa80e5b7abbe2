// SPDX-License-Identifier: Apache-2.0

#include "controller/servo/external_force.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/servo/servo_plan.hpp"

namespace kerf {

template <class N>
bool give_force(const ServoPlan<N>& plan, const ProgramForce& given,
                ExternalState<N>& state) noexcept {
  using Real = typename N::Real;
  const auto within = [](double value, double least, double most) {
    return value >= least && value <= most;  // false for NaN
  };
  const auto all_within = [&](const std::array<double, 3>& of, double most) {
    return std::ranges::all_of(of, [&](double value) { return within(value, -most, most); });
  };
  const bool has_goal = given.stiffness_n_per_mm != 0;
  if (!plan.external.on || !all_within(given.force_n, kMostExternalN) ||
      (has_goal && !all_within(given.goal_mm, kMostGoalMm)) ||
      !within(given.stiffness_n_per_mm, 0, plan.external.most_stiffness_n_per_mm) ||
      !within(given.damping_ns_per_mm, 0, plan.external.most_damping_ns_per_mm)) {
    return false;
  }
  const auto& [fx, fy, fz] = given.force_n;
  state.force_n = {Real(fx), Real(fy), Real(fz)};
  state.goal_mm = {};
  if (has_goal) {
    const auto& [gx, gy, gz] = given.goal_mm;
    const WorldVec<Real> goal_mm = WorldVec<Real>{Real(gx), Real(gy), Real(gz)} - plan.offset_mm;
    state.goal_mm = {goal_mm.x / plan.workspace_scale, goal_mm.y / plan.workspace_scale,
                     goal_mm.z / plan.workspace_scale};
  }
  state.stiffness_n_per_mm = typename N::Ratio(given.stiffness_n_per_mm);
  state.damping_ns_per_mm = typename N::Unit(given.damping_ns_per_mm);
  state.age_ticks = 0;
  state.from_log = false;
  return true;
}

template <class N>
void repeat_force(const std::array<float, 3>& contact_n, ExternalState<N>& state) noexcept {
  using Real = typename N::Real;
  state.force_n = {Real(double{contact_n[0]}), Real(double{contact_n[1]}),
                   Real(double{contact_n[2]})};
  state.from_log = true;
}

template <class N>
DeviceVec<typename N::Real> external_force(const ServoPlan<N>& plan, const ExternalState<N>& state,
                                           DeviceVec<typename N::Real> tip_mm,
                                           DeviceVec<typename N::Real> velocity_mm_per_s) noexcept {
  using Real = typename N::Real;
  if (state.from_log) return state.force_n;
  const Real level = Real(double(state.level)) / Real(double(plan.timing.fade_in_ticks));
  const auto axis = [&](Real force_n, Real goal, Real tip, Real velocity) {
    const Real whole_n = force_n + multiply<Real>(state.stiffness_n_per_mm, goal - tip) -
                         multiply<Real>(state.damping_ns_per_mm, velocity);
    const Real most(kMostExternalN);
    const Real bounded_n = std::clamp(whole_n, Real(0) - most, most) * level;
    if constexpr (N::kIsFixed) {
      return bounded_n;
    } else {
      return Real(static_cast<float>(bounded_n));
    }
  };
  return {axis(state.force_n.x, state.goal_mm.x, tip_mm.x, velocity_mm_per_s.x),
          axis(state.force_n.y, state.goal_mm.y, tip_mm.y, velocity_mm_per_s.y),
          axis(state.force_n.z, state.goal_mm.z, tip_mm.z, velocity_mm_per_s.z)};
}

#define KERF_INSTANTIATE(N)                                                                   \
  template bool give_force<N>(const ServoPlan<N>&, const ProgramForce&,                       \
                              ExternalState<N>&) noexcept;                                    \
  template void repeat_force<N>(const std::array<float, 3>&, ExternalState<N>&) noexcept;     \
  template DeviceVec<N::Real> external_force<N>(const ServoPlan<N>&, const ExternalState<N>&, \
                                                DeviceVec<N::Real>, DeviceVec<N::Real>) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
