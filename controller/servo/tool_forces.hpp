// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "controller/kernel/milling.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/tool_contact.hpp"

namespace kerf {

/// Contact and modification at the device port, before any limit, and what was cut because of this
/// tick's pose. Where force cuts, the modification force is its friction, and the cut comes later.
template <class N>
struct ToolForces {
  DeviceVec<typename N::Real> contact_n;
  DeviceVec<typename N::Real> modification_n;
  DeviceVec<typename N::Real> spring_n{}, friction_n{};  ///< of the contact: the rest is damping
  WorldVec<typename N::Real> proxy_offset_mm;            ///< from the tip; 0 without a proxy
  DeviceVec<typename N::Real>
      tip_torque_n_mm;                         ///< likewise; of both forces about the tool's centre
  ToolContact<N> tool;                         ///< likewise
  typename N::Real behind_n{};                 ///< likewise: of it on the shaft or the handpiece
  std::int64_t queried = 0;                    ///< likewise: samples, as query_work.hpp counts
  std::array<Removed, kMaxVolumes> removed{};  ///< by volume of the scene
};

/// Contact force of the active tool in all solid volumes as they are; then, where the plan cuts,
/// the modification force from the same densities, and only then the removal.
template <class N>
[[nodiscard]] ToolForces<N> feel_and_cut(const ServoPlan<N>& plan, ServoState<N>& state,
                                         WorldVec<typename N::Real> tip_mm,
                                         const Rotation<N>& rotation,
                                         DeviceVec<typename N::Real> velocity_mm_per_s) noexcept;

}  // namespace kerf
