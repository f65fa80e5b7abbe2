// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/servo/servo.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// All physics of one tick, a pure function of its arguments: no clock, device, allocation, lock,
/// system call or exception, and no loop without a bound known at load.
///
/// sanitise report -> kinematics -> safety -> contact force from the volumes as they are, and the
/// paper's cut by overlap -> limits -> stabiliser -> limits -> joint torques -> cut by the force
/// that was sent. A missing report holds the last force and then fades it; a pose that is not
/// finite holds it for `not_finite_ticks`, then the motors are switched off. During both there is
/// neither contact nor cut.
///
/// `reports` and `outputs` are by arm. The arms are stepped in this order: each sees the volumes as
/// the previous one left them. What a reset, an undo or a redo changes is in the first output.
template <class N>
void servo_step(Arms<N> arms, std::span<const DeviceReport> reports,
                std::span<ServoOutput> outputs) noexcept;

/// How far the active tool reaches into the solid along the contact force of the last tick, in mm;
/// 0 without contact. It is only displayed, so the real-time shell calls this after the force was
/// sent.
template <class N>
[[nodiscard]] double penetration_mm(const ServoPlan<N>& plan, const ServoState<N>& state) noexcept;

/// Applies a command between two ticks. Returns false, and changes nothing, if an index is out of
/// range, or if an undo or redo is not possible now.
template <class N>
bool apply_command(Arms<N> arms, const ServoCommand& command) noexcept;

}  // namespace kerf
