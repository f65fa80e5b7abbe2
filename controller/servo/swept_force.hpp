// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/tool_contact.hpp"

namespace kerf {

/// What the swept proxy gives the hand.
template <class N>
struct SweptForce {
  DeviceVec<typename N::Real> force_n;      ///< of the coupling, before any limit
  DeviceVec<typename N::Real> spring_n;     ///< part of it: of the spring, out of the faces
  DeviceVec<typename N::Real> friction_n;   ///< and along them
  WorldVec<typename N::Real> offset_mm;     ///< from the hand's tip to the proxy's
  DeviceVec<typename N::Real> torque_n_mm;  ///< of the contact about the tool's centre
  ToolContact<N> tool;
  typename N::Real behind_n{};  ///< what presses on the shaft or the handpiece, at the device port
  std::int64_t queried = 0;     ///< samples that it took, as query_work.hpp counts
};

/// One tick: the proxy of the active tool follows the hand, coupling or law pull the hand to the
/// proxy (docs/theory.md 4, 5.1). `rotation` turns the tool, unless it is a ball without a shaft or
/// keeps the world's axes. Servo thread; at most 32 queries; writes `state.contact`, and
/// `state.force_law` where the scene names a force law, whose force may not be finite.
template <class N>
[[nodiscard]] SweptForce<N> feel_swept(const ServoPlan<N>& plan, ServoState<N>& state,
                                       WorldVec<typename N::Real> tip_mm,
                                       const Rotation<N>& rotation,
                                       DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

}  // namespace kerf
