// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <type_traits>

#include "controller/kernel/covered_groups.hpp"
#include "controller/kernel/cutting_friction.hpp"
#include "controller/kernel/preston.hpp"
#include "controller/kernel/spindle.hpp"
#include "shared/volume/scene_limits.hpp"

namespace kerf {

/// The tool cuts kCutAdvance inside of the surface that it rests on, so that its groove leaves it
/// play (docs/theory.md 6.3); units of contact space. While it finds less than its force would cut
/// it reaches deeper, up to kDeepestAdvance, and then slowly back.
///
/// It may find less because its inner samples end inside of its surface, by up to a pitch
/// (SampleLattice::cover): its rims then rest on matter of which they cover little. A ball that is
/// given by its radius has samples at its surface at six poles alone.
inline constexpr double kCutAdvance = 0.25, kDeepestAdvance = 1;

/// Cutting by force; constant during a run. Arrays: by index of the plan's volumes.
template <class N>
struct ForceCutPlan {
  bool on = false;
  typename N::Real threshold_n{};  ///< force in the scene that cuts nothing yet
  typename N::Real deeper_step{};  ///< of the advance in a tick that finds too little, units
  typename N::Real back_step{};    ///< of the advance in any other
  SpindlePlan<N> spindle;
  FrictionPlan<N> friction;
  std::array<PrestonPlan<N>, kMaxVolumes> volume{};
  /// Size of a voxel over that of the largest, as a `share_of`.
  std::array<CutBudget<N>, kMaxVolumes> voxel_share{};
};

/// What the tool covers: groups for the kernels of fixed point, voxel by voxel otherwise.
template <class N>
using Covered = std::conditional_t<N::kIsFixed, CoveredGroups, CoveredVoxels<N>>;
template <class N>
using CoveredEntry = typename decltype(Covered<N>::list)::value_type;

/// The part that changes; the lists belong to the compiled scene.
template <class N>
struct ForceCutState {
  typename N::Real advance{kCutAdvance};
  SpindleState<N> spindle;
  Vec<typename N::Real, ToolSpace> friction_n;  ///< felt in the next tick, force in the scene
  std::array<PrestonState<N>, kMaxVolumes> volume{};
  std::array<std::span<CoveredEntry<N>>, kMaxVolumes> list{};  ///< scratch of one tick

  /// A new tool stands still and has cut nothing; what the materials are owed stays.
  constexpr void change_tool() noexcept {
    advance = typename N::Real(kCutAdvance);
    spindle = {};
    friction_n = {};
  }
};

}  // namespace kerf
