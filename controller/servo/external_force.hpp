// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "controller/servo/servo.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// The force of a program in place of contact (force.model = "external", docs/own-law.md).

namespace kerf {

template <class N>
struct ServoPlan;

/// Constants of a scene whose force comes from a program.
template <class N>
struct ExternalPlan {
  bool on = false;
  std::uint32_t stale_ticks = 20;      ///< a `ProgramForce` holds so long
  double most_stiffness_n_per_mm = 0;  ///< the scene's, which was checked for its device
  double most_damping_ns_per_mm = 0;
};

/// No component of a program's force is larger: below 2^8 N a `float` has all 16 fraction bits of
/// the loop, so that the log has the force exactly.
inline constexpr double kMostExternalN = 255;
inline constexpr double kMostGoalMm = 10'000;  ///< of a goal, by axis, in the scene

/// The last `ProgramForce` of an arm, and how much of it the hand gets.
template <class N>
struct ExternalState {
  using Real = typename N::Real;

  DeviceVec<Real> force_n;
  DeviceVec<Real> goal_mm;  ///< device port
  typename N::Ratio stiffness_n_per_mm{};
  typename N::Unit damping_ns_per_mm{};
  std::uint32_t age_ticks = UINT32_MAX;  ///< since it came
  std::uint32_t level = 0;  ///< of `fade_in_ticks`: rises while there is one, falls without
  bool from_log = false;    ///< a replay: the force is what contact_force_n had, level included

  /// Once a tick, before the force is asked for. As with a lost report the force falls within the
  /// time between holding and zero; back it comes as slowly as after arming.
  constexpr void follow(const ExternalPlan<N>& plan, const SafetyTiming& timing) noexcept {
    const bool holds = age_ticks < plan.stale_ticks;
    if (age_ticks < UINT32_MAX) ++age_ticks;
    if (holds) {
      level = std::min(level + 1, timing.fade_in_ticks);
      return;
    }
    const std::uint32_t fall_ticks =
        std::max<std::uint32_t>(1, timing.zero_ticks - timing.hold_ticks);
    level -= std::min(level, (timing.fade_in_ticks + fall_ticks - 1) / fall_ticks);
  }
};

/// Takes what a program asks for from the next tick on. Returns false, and changes nothing, for a
/// number that is not finite or beyond the two bounds above, and for a stiffness or a damping below
/// 0 or above the plan's. Without a stiffness the goal is not looked at.
template <class N>
[[nodiscard]] bool give_force(const ServoPlan<N>& plan, const ProgramForce& given,
                              ExternalState<N>& state) noexcept;

/// For a replay: the force of the next tick, as contact_force_n of its record has it.
template <class N>
void repeat_force(const std::array<float, 3>& contact_n, ExternalState<N>& state) noexcept;

/// The force of this tick before limits. A `float` has it exactly.
template <class N>
[[nodiscard]] DeviceVec<typename N::Real> external_force(
    const ServoPlan<N>& plan, const ExternalState<N>& state, DeviceVec<typename N::Real> tip_mm,
    DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

}  // namespace kerf
