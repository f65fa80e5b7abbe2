// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/covered_steps.hpp"
#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap_rows.hpp"

namespace kerf {

/// What `CoveredVoxels` of fixed point says, as groups of neighbours for the kernels of an
/// instruction set: the same bits. The list is in the caller's memory.
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

}  // namespace kerf
