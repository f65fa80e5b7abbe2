// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/cut_budget.hpp"
#include "controller/kernel/milling.hpp"

namespace kerf {

// Cutting by force: Preston's law, distributed over the voxels under the tool by the covered
// fraction of each (o_j) times the speed of the tool's surface there (v_j): docs/forces.md 6.2.
// Material that cannot be cut carries its part of the force and stays. With several volumes the sum
// of o v is over all of them: `CoveredWeights::whole`.

/// Constants of cutting one volume by force. Indexed by label; without labels, entry 0 is used.
template <class N>
struct PrestonPlan {
  ByMaterial<ForceRate<N>> rate{};
  ByMaterial<bool> forbidden{};   ///< never cut; a press on it is reported
  std::span<const Label> labels;  ///< one per voxel, or empty
};

/// State of a volume's cut for the next tick.
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
  bool starves = false;  ///< more than half a voxel of what is fed waits: some would soon be lost
};

namespace detail {

/// One tick of `cut_by_force` on one volume.
template <class N, class Covered>
class PrestonTick {
 public:
  using Sum = typename N::Sum;

  constexpr PrestonTick(const PrestonPlan<N>& plan, std::span<Density> density,
                        PrestonState<N>& state, Covered& covered) noexcept
      : plan_(plan), density_(density), state_(state), covered_(covered) {}

  /// Feeds the accounts of the materials under the tool and spends them.
  constexpr void cut(Sum drive, PrestonOutcome<N>& out) noexcept {
    each_material([&](std::size_t m) {
      const auto fed = portion<N>(budget_of(plan_.rate[m], drive),
                                  fraction_of<N>(covered_.load[m], covered_.whole));
      if (!(fed > 0)) return;
      fed_[m] = true;
      budget_[m] = fed + state_.carry[m] / kCarryTicks;
      state_.carry[m] += fed;
    });
    // What voxels at their limit cannot lose is given to the others once; the rest waits.
    if (spend(out.removed)) {
      weigh_again(covered_);
      spend(out.removed);
    }
    for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
      const auto kept = std::clamp(state_.carry[m], -kFullVoxel, kFullVoxel);
      out.lost += state_.carry[m] - kept;
      out.starves = out.starves || (fed_[m] && kept > kFullVoxel / 2);
      state_.carry[m] = kept;
    }
  }

 private:
  static constexpr CutBudget<N> kStep = N::kIsFixed ? CutBudget<N>(1 << kBudgetBits) : 1;
  /// The carry is spent over this many ticks: if it were spent at once, it would oscillate with the
  /// rounding.
  static constexpr CutBudget<N> kCarryTicks = 16;
  static constexpr CutBudget<N> kFullVoxel = CutBudget<N>(65535) * kStep;

  template <class Visit>
  constexpr void each_material(Visit&& visit) const noexcept {
    for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
      if (covered_.weight[m] > 0) visit(m);
    }
  }

  /// Removes the budgets from the volume. Returns whether a voxel had less left than its part.
  constexpr bool spend(Removed& removed) noexcept {
    ByMaterial<BudgetPerWeight<N>> price{};
    each_material([&](std::size_t m) { price[m] = {budget_[m], covered_.weight[m]}; });
    state_.phase = static_cast<std::uint16_t>(state_.phase + kPhaseByTick);
    const TakenSteps taken = take(covered_, price, state_.phase, density_);
    removed.changed = removed.changed.united(taken.changed);
    each_material([&](std::size_t m) {
      budget_[m] -= static_cast<CutBudget<N>>(taken.steps[m]) * kStep;
      state_.carry[m] -= static_cast<CutBudget<N>>(taken.steps[m]) * kStep;
      removed.density_steps += taken.steps[m];
    });
    return taken.full;
  }

  const PrestonPlan<N>& plan_;
  std::span<Density> density_;
  PrestonState<N>& state_;
  Covered& covered_;
  ByMaterial<CutBudget<N>> budget_{};  ///< of this tick, still to be spent
  ByMaterial<bool> fed_{};             ///< in this tick
};

}  // namespace detail

/// The forbidden materials among the covered voxels: bit m is material m.
template <class N>
[[nodiscard]] constexpr std::uint64_t touched_forbidden(const PrestonPlan<N>& plan,
                                                        const CoveredWeights<N>& covered) noexcept {
  static_assert(kMaxCutMaterials <= 64);
  std::uint64_t touched = 0;
  for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
    if (plan.forbidden[m] && covered.weight[m] > 0) touched |= std::uint64_t{1} << m;
  }
  return touched;
}

/// Whether the tool covers anything that may be cut.
template <class N>
[[nodiscard]] constexpr bool covers_what_is_cut(const PrestonPlan<N>& plan,
                                                const CoveredWeights<N>& covered) noexcept {
  for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
    if (covered.weight[m] > 0 && plan.rate[m] != ForceRate<N>{}) return true;
  }
  return false;
}

/// Removes from one volume the material that `drive` cuts in one tick, from the voxels that the
/// tool covers after its advance into the surface (servo_plan.hpp). Consumes their list,
/// `CoveredVoxels<N>` or `CoveredGroups`.
///
/// Removed steps, carry and `lost` add up to the budgets of all ticks: in fixed exactly, each
/// budget within a millionth. No voxel loses more than the part that the tool covers; an excess
/// goes to the others once, and the rest waits in the carry. Without drive nothing changes. Work is
/// bounded by the list. Servo thread; no heap.
template <class N, class Covered>
constexpr PrestonOutcome<N> cut_by_force(const PrestonPlan<N>& plan, typename N::Sum drive,
                                         std::span<Density> density, PrestonState<N>& state,
                                         Covered& covered) noexcept {
  PrestonOutcome<N> out;
  if (drive > 0) detail::PrestonTick<N, Covered>(plan, density, state, covered).cut(drive, out);
  return out;
}

}  // namespace kerf
