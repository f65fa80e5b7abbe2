// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "controller/servo/contact_force.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

// Cutting by the force that the hand feels, in the same tick. It uses the force after all limits,
// because a force that the hand does not feel must not cut (docs/forces.md 6.1).

/// What one tick cut.
template <class N>
struct ForceCut {
  typename N::Real normal_force_n{};  ///< normal force in the scene
  std::uint64_t forbidden = 0;        ///< bit m: the tool presses on material m, which is forbidden
  std::array<Removed, kMaxVolumes> removed{};  ///< by volume of the scene
};

/// Friction of the last cut at the device port, for the present orientation of the tool. With
/// x_scene = s x_device both sides have the same power if F_device = s F_scene.
template <class N>
[[nodiscard]] DeviceVec<typename N::Real> friction_of_last_cut(const ServoPlan<N>& plan,
                                                               const ServoState<N>& state,
                                                               const ContactResult<N>& at) noexcept;

/// Voxels of volume `v` under the tool at `centre_mm`.
template <class N>
[[nodiscard]] Covered<N> cover(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                               WorldVec<typename N::Real> centre_mm,
                               const ContactResult<N>& at) noexcept;

/// One tick of the spindle and of the cut at the contact. `sent_n` is the force that the hand
/// feels. The head's fraction of its normal component, over the workspace scale, is the normal
/// force in the scene (F_device = s F_scene). Friction is left out: it is computed from that force
/// and would feed back into itself. The spindle is switched on while `runs`. If it stands still, or
/// the pedal is up, nothing is cut and there is no friction.
///
/// The force of this tick makes this tick's cut; the hand feels the cut's friction from the next
/// tick on.
/// Servo thread; no heap. Work: the tool's box in each volume, and the voxels in it.
template <class N>
[[nodiscard]] ForceCut<N> cut_by_sent_force(const ServoPlan<N>& plan, ServoState<N>& state,
                                            const ContactResult<N>& at,
                                            DeviceVec<typename N::Real> sent_n, bool runs) noexcept;

}  // namespace kerf
