// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/preston_budget.hpp"

namespace kerf {

// Cutting that follows force: Preston's law dh/dt = k p v over the contact (haptics-science 1.4).
//
//   o_j = rho_j r_j        the part of voxel j that the tool covers
//   w_j = o_j v_j          v_j the speed of the tool's surface there, over its rim's
//   f_j = F_n w_j / SUM w  the part of the normal force that presses on it
//   dV_j = G_j f_j n/n_ref T
//
// So a tool between two materials presses on both, and each leaves at its own rate G under its own
// part of the force; in one material the volume per second is G F_n n/n_ref. What cannot be cut
// carries its part of the force and stays. Over several volumes the sum of w goes through all of
// them: each gets its share of the drive F_n n/n_ref (`cut_drive`).

/// How force cuts one volume; constant during a run. Index: label, 0 where there are no labels.
template <class N>
struct PrestonPlan {
  ByMaterial<ForceRate<N>> rate{};
  ByMaterial<bool> forbidden{};   ///< never cut, and told when pressed upon
  std::span<const Label> labels;  ///< one per voxel, or empty
};

/// What a volume's cut hands to the next tick.
template <class N>
struct PrestonState {
  /// Budget not yet spent, by material: at most one full voxel either way.
  ByMaterial<CutBudget<N>> carry{};
  std::uint16_t phase = 0;  ///< of the rounding
};

template <class N>
struct PrestonOutcome {
  Removed removed;
  /// Budget that found nothing to remove and went beyond the carry: 0 unless the force is more
  /// than the covered voxels can hold in one tick.
  CutBudget<N> lost{};
};

namespace detail {

/// One tick of `cut_by_force` on one volume.
template <class N>
class PrestonTick {
 public:
  using Sum = typename N::Sum;

  constexpr PrestonTick(const PrestonPlan<N>& plan, std::span<Density> density,
                        PrestonState<N>& state, CoveredVoxels<N>& covered) noexcept
      : plan_(plan), density_(density), state_(state), covered_(covered) {}

  /// Feeds the accounts of the materials under the tool and spends them.
  constexpr void cut(Sum drive, PrestonOutcome<N>& out) noexcept {
    const CutWeight<N> all = covered_.whole_weight();
    each_material([&](std::size_t m) {
      const auto fed =
          portion<N>(budget_of(plan_.rate[m], drive), share_of<N>(covered_.weight[m], all));
      if (!(fed > 0)) return;
      budget_[m] = fed + state_.carry[m] / kCarryTicks;
      state_.carry[m] += fed;
    });
    // What the fullest voxels cannot give is asked of the others once; the rest waits.
    if (spend(out.removed)) {
      weigh();
      spend(out.removed);
    }
    for (auto& carry : state_.carry) {
      const auto kept = std::clamp(carry, -kFullVoxel, kFullVoxel);
      out.lost += carry - kept;
      carry = kept;
    }
  }

 private:
  using Covered = typename CoveredVoxel<N>::Covered;
  static constexpr CutBudget<N> kStep = N::kIsFixed ? CutBudget<N>(1 << kBudgetBits) : 1;
  /// The carry is spent over so many ticks: all at once, it would swing with the rounding.
  static constexpr CutBudget<N> kCarryTicks = 16;
  static constexpr CutBudget<N> kFullVoxel = CutBudget<N>(65535) * kStep;

  template <class Visit>
  constexpr void each_material(Visit&& visit) const noexcept {
    for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
      if (covered_.weight[m] > 0) visit(m);
    }
  }

  /// Weights of what is still covered, by material.
  constexpr void weigh() noexcept {
    covered_.weight = {};
    for (CoveredVoxel<N>& voxel : covered_.list) {
      voxel.weight = weight_of<N>(voxel.covered, voxel.speed);
      covered_.weight[voxel.material] += voxel.weight;
    }
  }

  /// Takes the budgets from the volume. True when some voxel had less to give than its part.
  constexpr bool spend(Removed& removed) noexcept {
    ByMaterial<BudgetPerWeight<N>> price{};
    each_material([&](std::size_t m) { price[m] = {budget_[m], covered_.weight[m]}; });
    state_.phase = static_cast<std::uint16_t>(state_.phase + kPhaseByTick);
    ByMaterial<std::uint64_t> taken{};
    bool full = false;
    VoxelIndex lo{kPositionLimitVox, kPositionLimitVox, kPositionLimitVox}, hi{};
    for (CoveredVoxel<N>& voxel : covered_.list) {
      const Density steps = take(voxel, price[voxel.material].of(voxel.weight), full);
      if (steps == 0) continue;
      taken[voxel.material] += steps;
      const auto [x, y, z] = voxel.place;
      lo = {std::min<std::int32_t>(lo.x, x), std::min<std::int32_t>(lo.y, y),
            std::min<std::int32_t>(lo.z, z)};
      hi = {std::max<std::int32_t>(hi.x, x + 1), std::max<std::int32_t>(hi.y, y + 1),
            std::max<std::int32_t>(hi.z, z + 1)};
    }
    removed.changed = removed.changed.united({lo, hi});
    each_material([&](std::size_t m) {
      budget_[m] -= static_cast<CutBudget<N>>(taken[m]) * kStep;
      state_.carry[m] -= static_cast<CutBudget<N>>(taken[m]) * kStep;
      removed.density_steps += taken[m];
    });
    return full;
  }

  // The part of a step is rounded up or down by a phase that goes through the voxels and the ticks
  // along two irrational ways (those of the plastic number), so that it evens out in every voxel
  // and every tick. Rounding to the nearest would stall slow cutting.
  static constexpr std::uint32_t kPhaseByVoxel = 49471, kPhaseByTick = 37345;  // of 2^16

  /// Whole density steps of `wanted` leave the voxel; `full` is set when it has not so much.
  constexpr Density take(CoveredVoxel<N>& voxel, typename BudgetPerWeight<N>::Steps wanted,
                         bool& full) noexcept {
    const auto phase = static_cast<std::uint16_t>(voxel.at * kPhaseByVoxel + state_.phase);
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
    Density& rho = density_[voxel.at];
    const auto decrease = static_cast<Density>(std::min<std::uint32_t>(steps, rho));
    rho = static_cast<Density>(rho - decrease);
    return decrease;
  }

  const PrestonPlan<N>& plan_;
  std::span<Density> density_;
  PrestonState<N>& state_;
  CoveredVoxels<N>& covered_;
  ByMaterial<CutBudget<N>> budget_{};  ///< of this tick, still to be spent
};

}  // namespace detail

/// The tool, where it covers these voxels, touches a forbidden material.
template <class N>
[[nodiscard]] constexpr bool touches_forbidden(const PrestonPlan<N>& plan,
                                               const CoveredVoxels<N>& covered) noexcept {
  bool touches = false;
  for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
    touches = touches || (plan.forbidden[m] && covered.weight[m] > 0);
  }
  return touches;
}

/// Takes from one volume what `drive` cuts in one tick of the voxels that the tool covers, where it
/// is after an advance of a quarter voxel into the surface; their list is used up.
///
/// Removed steps, carry and `lost` add up to the budgets of all ticks: in fixed exactly, each
/// budget within a millionth. No voxel loses more than the part that the tool covers; what the
/// fullest cannot give is dealt out to the others once, and the rest waits in the carry. Without
/// drive nothing changes. Work is bounded by the list. Servo thread; no heap.
template <class N>
constexpr PrestonOutcome<N> cut_by_force(const PrestonPlan<N>& plan, typename N::Sum drive,
                                         std::span<Density> density, PrestonState<N>& state,
                                         CoveredVoxels<N>& covered) noexcept {
  PrestonOutcome<N> out;
  if (drive > 0) detail::PrestonTick<N>(plan, density, state, covered).cut(drive, out);
  return out;
}

}  // namespace kerf
