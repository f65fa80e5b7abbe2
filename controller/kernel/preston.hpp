// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap_rows.hpp"
#include "controller/kernel/preston_budget.hpp"
#include "controller/kernel/surface_drag.hpp"
#include "controller/kernel/surface_speed.hpp"

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
// carries its part of the force and stays.

/// Materials that a cut can tell apart; a label beyond counts as the last of them.
inline constexpr std::size_t kMaxCutMaterials = 64;

/// How force cuts one volume; constant during a run. Index: label, 0 where there are no labels.
template <class N>
struct PrestonPlan {
  std::array<ForceRate<N>, kMaxCutMaterials> rate{};
  std::array<bool, kMaxCutMaterials> forbidden{};  ///< never cut, and told when pressed upon
  typename N::Real threshold_n{};                  ///< force that cuts nothing yet
  std::span<const Label> labels;                   ///< one per voxel, or empty
};

/// What a volume's cut hands to the next tick.
template <class N>
struct PrestonState {
  /// Budget not yet spent, by material: at most one full voxel either way.
  std::array<CutBudget<N>, kMaxCutMaterials> carry{};
  std::uint16_t phase = 0;  ///< of the rounding
};

/// The tool's press on one volume in one tick.
template <class N>
struct PrestonPress {
  typename N::Real normal_force_n{};  ///< in the scene, after the force limit
  typename N::Unit spindle_ratio{};   ///< n / n_ref; 0: the spindle stands, nothing is cut
  SpindleFrame<N> frame;
};

template <class N>
struct PrestonOutcome {
  Removed removed;
  /// Budget that found nothing to remove and went beyond the carry: 0 unless the force is more
  /// than the covered voxels can hold in one tick.
  CutBudget<N> lost{};
  SurfaceDrag<N> drag;
  bool forbidden = false;  ///< the tool presses on a forbidden material
};

/// A voxel under the tool during one tick.
template <class N>
struct CoveredVoxel {
  std::uint32_t at;  ///< entry of the volume
  std::array<std::int16_t, 3> place;
  std::uint8_t material;
  typename N::Weight speed;
  /// Density that may still leave; fixed: 15 fraction bits.
  std::conditional_t<N::kIsFixed, std::uint32_t, typename N::Sum> covered;

  [[nodiscard]] constexpr CutWeight<N> weight() const noexcept {
    if constexpr (N::kIsFixed) {
      return std::uint64_t{covered} * static_cast<std::uint32_t>(speed) >> 15;
    } else {
      return covered * speed;
    }
  }
};

namespace detail {

/// One tick of `cut_by_force` on one volume.
template <class N>
class PrestonTick {
 public:
  using Sum = typename N::Sum;

  constexpr PrestonTick(const PrestonPlan<N>& plan, const VoxelGrid& grid,
                        std::span<Density> density, PrestonState<N>& state,
                        std::span<CoveredVoxel<N>> memory) noexcept
      : plan_(plan), grid_(grid), density_(density), state_(state), memory_(memory) {}

  /// Lists the voxels under the tool.
  template <class Overlap>
  constexpr void cover(const Overlap& overlap, const SpindleFrame<N>& frame,
                       PrestonOutcome<N>& out) noexcept {
    DragSums<N> drag;
    for_each_row(grid_, overlap, [&](VoxelIndex first, std::int32_t count, auto&& ratio) {
      const std::size_t row = grid_.index(first.x, first.y, first.z);
      const auto start = frame.at(first);
      for (std::int32_t i = 0; i < count; ++i) {
        const auto r = ratio(i);
        if (!(r > 0)) continue;
        const std::size_t at = row + static_cast<std::size_t>(i);
        if (density_[at] == 0 || found_ == memory_.size()) continue;
        const auto place = frame.behind(start, i);
        CoveredVoxel<N>& voxel = memory_[found_++];
        voxel.at = static_cast<std::uint32_t>(at);
        voxel.place = {static_cast<std::int16_t>(first.x + i), static_cast<std::int16_t>(first.y),
                       static_cast<std::int16_t>(first.z)};
        voxel.material = material_at(at);
        voxel.speed = SpindleFrame<N>::speed(place);
        voxel.covered = static_cast<Covered>(density_[at]) * static_cast<Covered>(r);
        out.forbidden = out.forbidden || plan_.forbidden[voxel.material];
        drag.add(voxel.covered, voxel.weight(), voxel.speed, place);
      }
    });
    out.drag = drag.mean();
  }

  /// Feeds the accounts of the materials under the tool and spends them.
  constexpr void cut(Sum drive, PrestonOutcome<N>& out) noexcept {
    weigh();
    CutWeight<N> all{};
    for (const auto weight : weight_) all += weight;
    for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
      if (!(weight_[m] > 0)) continue;
      const auto fed = portion<N>(budget_of(plan_.rate[m], drive), share_of<N>(weight_[m], all));
      if (!(fed > 0)) continue;
      budget_[m] = fed + state_.carry[m] / kCarryTicks;
      state_.carry[m] += fed;
    }
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
  using Covered = decltype(CoveredVoxel<N>::covered);
  static constexpr CutBudget<N> kStep = N::kIsFixed ? CutBudget<N>(1 << kBudgetBits) : 1;
  /// The carry is spent over so many ticks: all at once, it would swing with the rounding.
  static constexpr CutBudget<N> kCarryTicks = 16;
  static constexpr CutBudget<N> kFullVoxel = CutBudget<N>(65535) * kStep;

  [[nodiscard]] constexpr std::uint8_t material_at(std::size_t at) const noexcept {
    if (plan_.labels.empty()) return 0;
    return std::min(plan_.labels[at], static_cast<Label>(kMaxCutMaterials - 1));
  }
  [[nodiscard]] constexpr std::span<CoveredVoxel<N>> voxels() const noexcept {
    return memory_.first(found_);
  }

  /// Weights of what is still covered, by material.
  constexpr void weigh() noexcept {
    weight_ = {};
    for (const CoveredVoxel<N>& voxel : voxels()) weight_[voxel.material] += voxel.weight();
  }

  /// Takes the budgets from the volume. True when some voxel had less to give than its part.
  constexpr bool spend(Removed& removed) noexcept {
    std::array<BudgetPerWeight<N>, kMaxCutMaterials> price{};
    for (std::size_t m = 0; m < kMaxCutMaterials; ++m) price[m] = {budget_[m], weight_[m]};
    state_.phase = static_cast<std::uint16_t>(state_.phase + kPhaseByTick);
    bool full = false;
    for (CoveredVoxel<N>& voxel : voxels()) {
      const auto wanted = price[voxel.material].of(voxel.weight());
      const Density steps = take(voxel, wanted, full);
      if (steps == 0) continue;
      budget_[voxel.material] -= CutBudget<N>(steps) * kStep;
      state_.carry[voxel.material] -= CutBudget<N>(steps) * kStep;
      removed.density_steps += steps;
      const auto [x, y, z] = voxel.place;
      removed.changed = removed.changed.united({{x, y, z}, {x + 1, y + 1, z + 1}});
    }
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
      voxel.covered -= static_cast<std::uint32_t>(wanted >> 1);
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
  const VoxelGrid& grid_;
  std::span<Density> density_;
  PrestonState<N>& state_;
  std::span<CoveredVoxel<N>> memory_;
  std::size_t found_ = 0;
  std::array<CutWeight<N>, kMaxCutMaterials> weight_{};
  std::array<CutBudget<N>, kMaxCutMaterials> budget_{};  ///< of this tick, still to be spent
};

}  // namespace detail

/// Takes from one volume what the tool's press cuts in one tick. `overlap` holds the ratios of the
/// tool where it is after an advance of a quarter voxel into the surface: a `BoxOverlap`, or an
/// `OverlapBox<N>` that `overlap` filled.
///
/// Removed steps, carry and `lost` add up to the budgets of all ticks: in fixed exactly, each
/// budget within a millionth. No voxel loses more than the part that the tool covers; what the
/// fullest cannot give is dealt out to the others once, and the rest waits in the carry. Without
/// force, or with the spindle standing, nothing changes. Work is bounded by `memory`, which the
/// scene sizes for the whole overlap: voxels beyond it are not cut. Servo thread; no heap.
template <class N, class Overlap>
constexpr PrestonOutcome<N> cut_by_force(const PrestonPlan<N>& plan, const PrestonPress<N>& press,
                                         const VoxelGrid& grid, std::span<Density> density,
                                         const Overlap& overlap, PrestonState<N>& state,
                                         std::span<CoveredVoxel<N>> memory) noexcept {
  PrestonOutcome<N> out;
  if (!(press.normal_force_n > typename N::Real{})) return out;
  detail::PrestonTick<N> tick(plan, grid, density, state, memory);
  tick.cover(overlap, press.frame, out);
  const auto drive = cut_drive<N>(press.normal_force_n, plan.threshold_n, press.spindle_ratio);
  if (drive > 0) tick.cut(drive, out);
  return out;
}

}  // namespace kerf
