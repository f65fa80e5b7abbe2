// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "controller/servo/device_pose.hpp"
#include "controller/servo/device_report.hpp"
#include "controller/servo/plain_numbers.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/supervisor.hpp"

namespace kerf {

// The first half of the servo step: from a report to the tip, its velocity and whether the motors
// may be on.

/// How the tip moved since it was last known.
struct TipMotion {
  bool overspeed = false;  ///< faster than the limit
  bool leaves = false;     ///< with the force of the last tick
};

/// Takes the new tip over. The energy ledger books the motion at the mean of the forces that were
/// sent meanwhile, as if it had been even.
template <class N>
TipMotion move_tip(const ServoPlan<N>& plan, ServoState<N>& state,
                   const DevicePose<N>& pose) noexcept {
  using Real = typename N::Real;
  const std::uint32_t gap = std::clamp<std::uint32_t>(state.tip_ticks, 1, 1000);
  if (!state.tip_known) state.tip_mm = pose.arm.tip_mm;
  const auto moved_mm = pose.arm.tip_mm - state.tip_mm;
  const auto ticks = Real(static_cast<double>(gap));
  const DeviceVec<Real> sent_n =
      gap == 1 ? state.force_n
               : DeviceVec<Real>{state.force_sum_n.x / ticks, state.force_sum_n.y / ticks,
                                 state.force_sum_n.z / ticks};
  state.ledger.move(sent_n, moved_mm, gap);
  state.velocity_mm_per_s =
      plan.velocity(state.velocity, {pose.arm.tip_mm, gap, !state.velocity.begun});
  state.moved_mm = moved_mm;
  state.moved_ticks = gap;
  state.tip_mm = pose.arm.tip_mm;
  state.rotation = pose.rotation;
  state.tip_known = true;
  state.tip_ticks = 0;
  state.force_sum_n = {};
  return {norm(moved_mm) > plan.speed_limit_mm_per_tick * ticks,
          dot(state.force_n, moved_mm) > Real(0)};
}

/// What the device reported in this tick.
template <class N>
struct Sensed {
  DevicePose<N> pose;
  bool usable = false;  ///< a fresh report with a finite pose
  bool leaves = false;  ///< the hand moves with the force of the last tick
  bool docked = false;  ///< parked at rest: calibrated in this tick
  WorldVec<typename N::Real> tip_mm;
  DeviceVec<typename N::Real> velocity_mm_per_s;
};

/// Where the device is and whether that can be trusted; decides about the motors.
template <class N>
[[nodiscard]] Sensed<N> sense(const ServoPlan<N>& plan, ServoState<N>& state,
                              const DeviceReport& report) noexcept {
  SafetyInputs seen{.fresh = report.fresh, .parked = report.parked, .homed = report.homed};
  seen.calibrated =
      follow_encoders(report, plan.device.absolute_encoders, plan.timing, state.encoders);
  if (report.fresh) follow_gimbal(report, plan.device.gimbal_samples, state.gimbal);
  Sensed<N> sensed;
  sensed.pose = device_pose(plan.device, state.encoders, state.gimbal);
  seen.finite = all_finite(sensed.pose.arm.tip_mm);
  sensed.usable = seen.fresh && seen.finite;
  sensed.docked = seen.calibrated;
  state.tip_ticks += state.tip_ticks < UINT32_MAX ? 1U : 0U;
  if (sensed.usable) {
    state.jacobian_t_mm = sensed.pose.arm.jacobian_t_mm;
    // The device rests, maybe at another place than its counters told so far.
    if (sensed.docked) state.velocity.begin_anew();
    const TipMotion motion = move_tip(plan, state, sensed.pose);
    seen.overspeed = motion.overspeed && !report.parked;
    sensed.leaves = motion.leaves;
  }
  const bool known_velocity = all_finite(state.velocity_mm_per_s);
  if (!known_velocity) {
    state.velocity.begin_anew();
    state.velocity_mm_per_s = {};
  }
  sensed.velocity_mm_per_s = state.velocity_mm_per_s;
  sensed.tip_mm = relabel<WorldSpace>(state.tip_mm * plan.workspace_scale) + plan.offset_mm;
  supervise(plan.timing, seen, state.supervisor);
  if (!known_velocity && state.supervisor.motors_on()) {
    latch(Fault::velocity_estimator, state.supervisor);
  }
  return sensed;
}

}  // namespace kerf
