// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/preston_budget.hpp"

namespace kerf {

// How a budget leaves the voxels that a tool covers (docs/theory.md 6.2).
//
// A voxel loses whole density steps. Fractions are rounded up or down by a phase that advances by
// one irrational number from voxel to voxel and by another from tick to tick (powers of the plastic
// number), so that they even out along both. Rounding to the nearest would stall slow cutting.
inline constexpr std::uint16_t kPhaseByVoxel = 49471, kPhaseByTick = 37345;  // of 2^16

/// Density steps that left, by material, and the box of voxels that changed: empty if none did.
struct TakenSteps {
  ByMaterial<std::uint64_t> steps{};
  VoxelBox changed;
  bool full = false;  ///< some voxel had less to give than its part
};

/// Weighs again what is still covered after a `take`.
template <class N>
constexpr void weigh_again(CoveredVoxels<N>& covered) noexcept {
  covered.weight = {};
  for (CoveredVoxel<N>& voxel : covered.list) {
    voxel.weight = weight_of<N>(voxel.covered, voxel.speed);
    covered.weight[voxel.material] += voxel.weight;
  }
}

namespace detail {

/// Takes `wanted` steps, at most what is covered, from a voxel; returns how many whole ones left.
/// Sets `full` where the voxel had less to give.
template <class N>
constexpr Density take_from(CoveredVoxel<N>& voxel, typename BudgetPerWeight<N>::Steps wanted,
                            std::uint16_t tick_phase, Density& rho, bool& full) noexcept {
  using Sum = typename N::Sum;
  using Covered = typename CoveredVoxel<N>::Covered;
  const auto phase = static_cast<std::uint16_t>(voxel.at * kPhaseByVoxel + tick_phase);
  std::uint32_t steps = 0;
  if constexpr (N::kIsFixed) {  // 16 fraction bits
    const std::uint64_t most = std::uint64_t{voxel.covered} << 1;
    full = full || wanted > most;
    wanted = std::min(wanted, most);
    voxel.covered -= static_cast<Covered>(wanted >> 1);
    steps = static_cast<std::uint32_t>((wanted + phase) >> 16);
  } else {
    full = full || wanted > voxel.covered;
    wanted = std::min(wanted, voxel.covered);
    voxel.covered -= wanted;
    steps = static_cast<std::uint32_t>(wanted + Sum(phase) / Sum(65536));
  }
  const auto decrease = static_cast<Density>(std::min<std::uint32_t>(steps, rho));
  rho = static_cast<Density>(rho - decrease);
  return decrease;
}

}  // namespace detail

/// Takes from each voxel its weight times the `price` of its material, in density steps; `phase` is
/// that of this tick's rounding.
template <class N>
constexpr TakenSteps take(CoveredVoxels<N>& covered, const ByMaterial<BudgetPerWeight<N>>& price,
                          std::uint16_t phase, std::span<Density> density) noexcept {
  TakenSteps taken;
  VoxelIndex lo{kPositionLimitVox, kPositionLimitVox, kPositionLimitVox}, hi{};
  for (CoveredVoxel<N>& voxel : covered.list) {
    const Density steps = detail::take_from(voxel, price[voxel.material].of(voxel.weight), phase,
                                            density[voxel.at], taken.full);
    if (steps == 0) continue;
    taken.steps[voxel.material] += steps;
    const auto [x, y, z] = voxel.place;
    lo = {std::min<std::int32_t>(lo.x, x), std::min<std::int32_t>(lo.y, y),
          std::min<std::int32_t>(lo.z, z)};
    hi = {std::max<std::int32_t>(hi.x, x + 1), std::max<std::int32_t>(hi.y, y + 1),
          std::max<std::int32_t>(hi.z, z + 1)};
  }
  taken.changed = {lo, hi};
  return taken;
}

}  // namespace kerf
