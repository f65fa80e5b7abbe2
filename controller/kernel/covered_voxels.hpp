// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "controller/kernel/cut_budget.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/surface_motion.hpp"

// The voxels under the tool in one tick: their weights, the loads that they bear, and their
// removal; as a list of voxels, and as groups of neighbours for the kernels of fixed point.

namespace kerf {

/// Indexed by label; without labels only entry 0 is used.
template <class T>
using ByMaterial = std::array<T, kMaxCutMaterials>;

/// covered times speed; fixed: 15 fraction bits.
template <class N, class Covered>
[[nodiscard]] constexpr Covered weight_of(Covered covered, typename N::Weight speed) noexcept {
  if constexpr (N::kIsFixed) {
    return static_cast<Covered>(std::uint64_t{covered} * static_cast<Covered>(speed) >> 15);
  } else {
    return covered * speed;
  }
}

/// A voxel under the tool during one tick.
template <class N>
struct CoveredVoxel {
  using Covered = std::conditional_t<N::kIsFixed, std::uint32_t, typename N::Sum>;

  std::uint32_t at;                   ///< entry of the volume
  std::array<std::int16_t, 3> place;  ///< in the volume
  std::uint16_t material;
  typename N::Weight speed;
  Covered covered;  ///< density that may still leave; fixed: 15 fraction bits
  Covered weight;   ///< times speed
};

/// Sums by material over the voxels under the tool, and the motion of the tool's surface there.
template <class N>
struct CoveredWeights {
  ByMaterial<CutWeight<N>> weight{};  ///< sums of the list's
  ByMaterial<CutWeight<N>>
      load{};            ///< distribution of a press over materials: the weights, or `loads`
  CutWeight<N> whole{};  ///< sum of all loads
  SurfaceDrag<N> drag;

  /// Distributes the press by the weights.
  constexpr void share_by_weight() noexcept {
    load = weight;
    whole = {};
    for (const CutWeight<N> part : load) whole += part;
  }
};

/// The voxels that the tool covers in one tick. The list is in the caller's memory, in z, y, x
/// order.
template <class N>
struct CoveredVoxels : CoveredWeights<N> {
  std::span<CoveredVoxel<N>> list;
};

namespace detail {

/// One run of `covered_voxels`.
template <class N>
class CoverScan {
 public:
  using Place = typename SpindleFrame<N>::Place;

  constexpr CoverScan(const VoxelGrid& grid, std::span<const Density> density,
                      std::span<const Label> labels, std::span<CoveredVoxel<N>> memory) noexcept
      : grid_(grid), density_(density), labels_(labels), memory_(memory) {}

  template <class Overlap>
  [[nodiscard]] constexpr CoveredVoxels<N> run(const Overlap& overlap,
                                               const SpindleFrame<N>& frame) noexcept {
    DragSums<N> drag;
    for_each_row(grid_, overlap, [&](VoxelIndex first, std::int32_t count, auto&& ratio) {
      const Place start = frame.at(first);
      drag.add(add_row(first, count, ratio, start, frame.step()), start, frame.step());
    });
    found_.drag = drag.mean();
    found_.share_by_weight();
    found_.list = memory_.first(count_);
    return found_;
  }

 private:
  using Covered = typename CoveredVoxel<N>::Covered;

  [[nodiscard]] constexpr Label material_at(std::size_t at) const noexcept {
    if (labels_.empty()) return 0;
    return std::min(labels_[at], static_cast<Label>(kMaxCutMaterials - 1));
  }

  // The values of a row are in locals, which stay in registers while the list is written.
  template <class Ratio>
  constexpr typename DragSums<N>::Row add_row(VoxelIndex first, std::int32_t count, Ratio ratio,
                                              Place place, Place step) noexcept {
    const std::size_t row = grid_.index(first.x, first.y, first.z);
    const std::span<const Density> density = density_;
    CoveredVoxel<N>* voxel = memory_.data() + count_;
    const CoveredVoxel<N>* const end = memory_.data() + memory_.size();
    typename DragSums<N>::Row sums;
    CutWeight<N> settled{};
    Label material = 0;
    for (std::int32_t i = 0; i < count; ++i, place = place + step) {
      const auto r = ratio(i);
      if (!(r > 0)) continue;  // a row may begin outside of the volume, without a ratio
      const std::size_t at = row + static_cast<std::size_t>(i);
      const Density rho = density[at];
      if (rho == 0 || voxel == end) continue;
      const Label here = material_at(at);
      if (here != material) {
        found_.weight[material] += sums.weight - settled;
        settled = sums.weight;
        material = here;
      }
      const auto speed = SpindleFrame<N>::speed(place);
      const Covered covered = static_cast<Covered>(rho) * static_cast<Covered>(r);
      const Covered weight = weight_of<N>(covered, speed);
      sums.covered += covered;
      sums.covered_number += covered * static_cast<CutWeight<N>>(i);
      sums.weight += weight;
      sums.weight_speed += weight * static_cast<CutWeight<N>>(speed);
      voxel->at = static_cast<std::uint32_t>(at);
      voxel->place = {static_cast<std::int16_t>(first.x + i), static_cast<std::int16_t>(first.y),
                      static_cast<std::int16_t>(first.z)};
      voxel->material = here;
      voxel->speed = speed;
      voxel->covered = covered;
      voxel->weight = weight;
      ++voxel;
    }
    found_.weight[material] += sums.weight - settled;
    count_ = static_cast<std::size_t>(voxel - memory_.data());
    return sums;
  }

  const VoxelGrid& grid_;
  std::span<const Density> density_;
  std::span<const Label> labels_;
  std::span<CoveredVoxel<N>> memory_;
  std::size_t count_ = 0;
  CoveredVoxels<N> found_;
};

}  // namespace detail

/// Voxels with density under the tool, as many as `memory` holds. `overlap` is a `BoxOverlap` or an
/// `OverlapBox<N>`, `labels` one per voxel or empty. Servo thread; no heap.
template <class N, class Overlap>
[[nodiscard]] constexpr CoveredVoxels<N> covered_voxels(
    const VoxelGrid& grid, std::span<const Density> density, std::span<const Label> labels,
    const Overlap& overlap, const SpindleFrame<N>& frame,
    std::span<CoveredVoxel<N>> memory) noexcept {
  return detail::CoverScan<N>(grid, density, labels, memory).run(overlap, frame);
}

// Removal of a budget from the covered voxels (docs/forces.md 6.2).
//
// A voxel loses whole density steps. Fractions are rounded up or down by a phase that advances by
// one irrational number from voxel to voxel and by another from tick to tick (powers of the plastic
// number), so that they even out along both. Rounding to the nearest would stall slow cutting.
inline constexpr std::uint16_t kPhaseByVoxel = 49471, kPhaseByTick = 37345;  // of 2^16

/// Density steps that left, by material, and the box of voxels that changed: empty if none did.
struct TakenSteps {
  ByMaterial<std::uint64_t> steps{};
  VoxelBox changed;
  bool full = false;  ///< a voxel had less left than its part
};

/// Weighs the voxels again after a `take`.
template <class N>
constexpr void weigh_again(CoveredVoxels<N>& covered) noexcept {
  covered.weight = {};
  for (CoveredVoxel<N>& voxel : covered.list) {
    voxel.weight = weight_of<N>(voxel.covered, voxel.speed);
    covered.weight[voxel.material] += voxel.weight;
  }
}

namespace detail {

/// Removes `wanted` steps, at most what is covered, from a voxel; returns how many whole steps that
/// were. Sets `full` if the voxel had less left.
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

/// Removes from each voxel its weight times the `price` of its material, in density steps; `phase`
/// is that of the rounding in this tick.
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

/// `CoveredVoxels` of fixed point as groups of neighbours, for the kernels of an instruction set:
/// the same bits. The list is in the caller's memory.
struct CoveredGroups : CoveredWeights<FixedNumbers> {
  const KernelSet* kernels = nullptr;
  std::span<CoveredGroup> list;
};

/// `covered_voxels`, as many groups as `memory` holds. Servo thread; no heap.
[[nodiscard]] inline CoveredGroups covered_groups(const KernelSet& kernels, const VoxelGrid& grid,
                                                  std::span<const Label> labels,
                                                  const BoxOverlap& overlap,
                                                  const SpindleFrame<FixedNumbers>& frame,
                                                  std::span<CoveredGroup> memory) noexcept {
  using Frame = SpindleFrame<FixedNumbers>;
  CoveredGroups found;
  found.kernels = &kernels;
  detail::DragSums<FixedNumbers> drag;
  const Frame::Place step = frame.step();
  CoverRow row{.labels = labels.empty() ? nullptr : labels.data(),
               .label_count = static_cast<std::int64_t>(labels.size()),
               .step = {step.x, step.z},
               .roots = kSpeedRoots.data(),
               .slowest = Frame::kFloor};
  std::size_t count = 0;
  for_each_row(grid, overlap, [&](VoxelIndex first, std::int32_t voxels, const StoredRow& stored) {
    const Frame::Place place = frame.at(first);
    row.ratio = stored.ratio;
    row.density = stored.density;
    row.count = voxels;
    row.first = first;
    row.at = (std::int64_t{first.z} * grid.ny + first.y) * grid.nx + first.x;
    row.place[0] = place.x;
    row.place[1] = place.z;
    CoverSums sums;
    const auto room = static_cast<std::int32_t>(memory.size() - count);
    count += static_cast<std::size_t>(
        kernels.weigh_row(row, memory.data() + count, room, sums, found.weight.data()));
    drag.add({sums.covered, sums.covered_number, sums.weight, sums.weight_speed}, place, step);
  });
  found.drag = drag.mean();
  found.share_by_weight();
  found.list = memory.first(count);
  return found;
}

inline void weigh_again(CoveredGroups& covered) noexcept {
  covered.weight = {};
  covered.kernels->weigh_again(covered.list.data(), static_cast<std::int32_t>(covered.list.size()),
                               covered.weight.data());
}

[[nodiscard]] inline TakenSteps take(CoveredGroups& covered,
                                     const ByMaterial<BudgetPerWeight<FixedNumbers>>& price,
                                     std::uint16_t phase, std::span<Density> density) noexcept {
  CoverSpend spend;
  for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
    spend.mantissa[m] = static_cast<std::uint32_t>(price[m].mantissa());
    spend.shift[m] = static_cast<std::uint32_t>(price[m].shift());
  }
  spend.phase = phase;
  spend.phase_by_voxel = kPhaseByVoxel;
  CoverTaken out{};
  out.lo = {kPositionLimitVox, kPositionLimitVox, kPositionLimitVox};
  covered.kernels->take_steps(spend, covered.list.data(),
                              static_cast<std::int32_t>(covered.list.size()), density.data(),
                              static_cast<std::int64_t>(density.size()), out);
  TakenSteps taken{.changed = {out.lo, out.hi}, .full = out.full};
  std::copy_n(out.steps, kMaxCutMaterials, taken.steps.begin());
  return taken;
}

// Loads: which of the materials under the tool bear its press (docs/forces.md 6.2). A tool in its
// own bore covers voxels of the wall all around, but rests on one side of it. A contact is a plane
// with the normal n, out of the solid, through a point of the tool's surface. Voxel j lies h_j
// above it, and counts at the contact with ahead(j) = 1 - h_j / w if that is positive.
//
// On a bed of even stiffness the pressure is proportional to the component of the surface normal
// along the press. For a ball that is ahead(j) with w = R. For the flank, the end and the rim of
// another tool w is one unit, half of the ramp of a face.

/// Largest ratio of a tool's rim radius to w; 1 for a ball.
inline constexpr double kSteepest = 64;

/// A contact of a tool, seen from its centre.
template <class N>
struct LoadPlane {
  WorldVec<typename N::Unit> normal{};
  typename N::Ratio height{};     ///< of its point along the normal, in rim radii: -1 of a ball
  typename N::Ratio steepness{};  ///< rim radius over w
};

/// ahead(j) as a linear form of the position of the voxel. Fixed: 20 fraction bits; steps below
/// 2^30, positions below 2^13.
template <class N>
[[nodiscard]] constexpr AheadForm<typename N::Sum> contact_form(
    VoxelVec<typename N::Real> centre_vox,
    const Transform<typename N::Ratio, WorldSpace, VoxelSpace>& rims_from_voxel,
    const LoadPlane<N>& plane) noexcept {
  using Sum = typename N::Sum;
  using Ratio = typename N::Ratio;
  const auto press = [&](typename N::Unit part) { return -(plane.steepness * Ratio(part)); };
  const Ratio along[3] = {press(plane.normal.x), press(plane.normal.y), press(plane.normal.z)};
  AheadForm<Sum> form{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& row = rims_from_voxel.row;
    if constexpr (N::kIsFixed) {  // Q24 * Q24, three terms below 2^59
      Sum sum = 0;
      for (std::size_t i = 0; i < 3; ++i) sum += Sum{row[i][axis].raw()} * along[i].raw();
      form.step[axis] = round_shift(sum, 48 - 20);
    } else {
      form.step[axis] = row[0][axis] * along[0] + row[1][axis] * along[1] + row[2][axis] * along[2];
    }
  }
  const auto& [x, y, z] = centre_vox;
  if constexpr (N::kIsFixed) {  // of the heights Q24 * Q24, below 2^62
    form.origin =
        (Sum{1} << 20) + round_shift(Sum{plane.steepness.raw()} * plane.height.raw(), 48 - 20) -
        round_shift(form.step[0] * x.raw() + form.step[1] * y.raw() + form.step[2] * z.raw(), 16);
  } else {
    form.origin = 1 + plane.steepness * plane.height -
                  (form.step[0] * x + form.step[1] * y + form.step[2] * z);
  }
  return form;
}

/// The form with which every covered voxel has weight 1.
template <class N>
[[nodiscard]] constexpr AheadForm<typename N::Sum> everywhere() noexcept {
  return {N::kIsFixed ? typename N::Sum(1 << 20) : typename N::Sum(1), {}};
}

/// Sums by material of weights times `ahead`, clamped to 0..1: of all voxels at a contact, and of
/// those that reach the iso. Voxels below the iso bear no load.
template <class N>
struct CoveredLoads {
  ByMaterial<CutWeight<N>> ahead{}, bearing{};

  friend constexpr bool operator==(const CoveredLoads&, const CoveredLoads&) = default;
};

/// `density` is that of the volume. Work: the list.
template <class N>
[[nodiscard]] constexpr CoveredLoads<N> loads(const CoveredVoxels<N>& covered,
                                              const AheadForm<typename N::Sum>& form,
                                              std::span<const Density> density,
                                              Density iso) noexcept {
  using Sum = typename N::Sum;
  CoveredLoads<N> found;
  for (const CoveredVoxel<N>& voxel : covered.list) {
    Sum ahead = form.origin;
    for (std::size_t axis = 0; axis < 3; ++axis) ahead += form.step[axis] * Sum(voxel.place[axis]);
    const Sum at_most_1 = std::clamp<Sum>(ahead, 0, N::kIsFixed ? Sum(1 << 20) : Sum(1));
    CutWeight<N> load{};
    if constexpr (N::kIsFixed) {
      load = weight_of<N>(voxel.weight, static_cast<typename N::Weight>(at_most_1 >> 5));
    } else {
      load = voxel.weight * at_most_1;
    }
    found.ahead[voxel.material] += load;
    if (density[voxel.at] >= iso) found.bearing[voxel.material] += load;
  }
  return found;
}

/// `loads` of groups; gives the bits of the function above.
[[nodiscard]] inline CoveredLoads<FixedNumbers> loads(const CoveredGroups& covered,
                                                      const AheadForm<std::int64_t>& form,
                                                      std::span<const Density> density,
                                                      Density iso) noexcept {
  CoveredLoads<FixedNumbers> found;
  covered.kernels->add_loads(
      form, covered.list.data(), static_cast<std::int32_t>(covered.list.size()), density.data(),
      static_cast<std::int64_t>(density.size()), iso, found.ahead.data(), found.bearing.data());
  return found;
}

}  // namespace kerf
