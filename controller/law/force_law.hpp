// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/law/law_plan.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// What a force law sees in one tick of the swept contact. In air the spring and the normal are 0.
template <class N>
struct ForceInput {
  DeviceVec<typename N::Real> tip_mm;             ///< of the hand, at the device port
  WorldVec<typename N::Real> scene_tip_mm;        ///< the same place in the scene
  DeviceVec<typename N::Real> velocity_mm_per_s;  ///< at the device port, as estimated
  /// From the hand to the proxy, which rests on the surface: where the coupling of
  /// controller/law/coupling.hpp pulls the hand to.
  DeviceVec<typename N::Real> spring_mm;
  DeviceVec<typename N::Unit> normal;  ///< out of the solid, of all that the tool presses on
};

/// A force law gives the force on the hand in N, before any limit, in place of the coupling. It
/// runs in each tick in which the hand is felt, and begins anew after each in which it was not.
template <class N>
using ForceLawPlan = LawPlan<ForceInput<N>, typename N::Real>;

}  // namespace kerf
