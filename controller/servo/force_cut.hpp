// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "controller/servo/contact_force.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

// Cutting because of the force that the hand feels, in the same tick: after all limits, since what
// the hand does not feel must not cut (docs/theory.md 6.1).

/// What one tick cut.
template <class N>
struct ForceCut {
  typename N::Real normal_force_n{};  ///< normal force in the scene
  std::uint64_t forbidden = 0;        ///< bit m: the tool presses on material m, which is forbidden
  std::array<Removed, kMaxVolumes> removed{};  ///< by volume of the scene
};

/// Friction of the last cut at the device port, for the tool as it is held now. By
/// x_scene = s x_device power is kept: F_device = s F_scene.
template <class N>
[[nodiscard]] DeviceVec<typename N::Real> friction_of_last_cut(const ServoPlan<N>& plan,
                                                               const ServoState<N>& state,
                                                               const ContactResult<N>& at) noexcept;

/// Voxels of volume `v` under the tool at `centre_mm`.
template <class N>
[[nodiscard]] Covered<N> cover(const ServoPlan<N>& plan, ServoState<N>& state, std::size_t v,
                               WorldVec<typename N::Real> centre_mm,
                               const ContactResult<N>& at) noexcept;

/// One tick of the spindle, and of what it cuts where the tool touches. `sent_n` is the force that
/// the hand feels; the head's share of its normal part, over the workspace scale, presses in the
/// scene, by F_device = s F_scene. Friction is left out of it: it is made of that force and would
/// feed on itself. The spindle is switched on while `runs`; where it stands, or the pedal is up,
/// nothing is cut and nothing rubs.
///
/// The force of this tick decides about this cut; the cut's friction is felt from the next tick on.
/// Servo thread; no heap. Work: the tool's box in each volume, and the voxels in it.
template <class N>
[[nodiscard]] ForceCut<N> cut_by_sent_force(const ServoPlan<N>& plan, ServoState<N>& state,
                                            const ContactResult<N>& at,
                                            DeviceVec<typename N::Real> sent_n, bool runs) noexcept;

}  // namespace kerf
