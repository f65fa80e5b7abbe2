// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/sets/set_common.hpp"
#include "shared/volume/voxel_grid.hpp"

// Plain loops, which define the bits, for sets without vectors of their own: contact of the method
// `gather`, weights and losses of covered voxels. Internal linkage, for the reason given at
// KernelSet.

namespace kerf {
namespace {

/// `contact_sum` of a field of three 16-bit parts a voxel.
void gather(const SampleTable& samples, const SamplePose& pose, const VoxelGrid& grid,
            const std::int16_t* field, std::int64_t (&sum)[3]) noexcept {
  sum[0] = sum[1] = sum[2] = 0;
  for (std::int32_t first = 0; first < samples.count; first += kSampleGroup) {
    std::int32_t place[3][kSampleGroup];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place_along(samples, first, pose.centre[axis], pose.step[axis], place[axis]);
    }
    SampleCells cells;
    find_cells(place[0], place[1], place[2], cells);
    for (std::int32_t i = 0; i < kSampleGroup && first + i < samples.count; ++i) {
      const VoxelIndex low{cells.low[0][i], cells.low[1][i], cells.low[2][i]};
      if (!grid.contains(low) || !grid.contains({low.x + 1, low.y + 1, low.z + 1})) continue;
      for (std::int32_t c = 0; c < 8; ++c) {
        const std::int16_t* g =
            field + 3 * grid.index(low.x + (c & 1), low.y + (c >> 1 & 1), low.z + (c >> 2));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          sum[axis] += cells.weight[c][i] * g[axis];
        }
      }
    }
  }
}

// Weight and loss of a group of voxels under the tool (docs/forces.md 6.2). cover_vector.hpp has
// the same bits.

/// Position of voxel `number` along one axis beside the spindle, clamped to one rim radius (2^20)
/// to each side: beyond it the speed is the rim's. No product leaves 2^42.
[[gnu::always_inline]] inline std::int64_t place_beside(std::int64_t first, std::int64_t step,
                                                        std::int64_t number) noexcept {
  constexpr std::int64_t kRim = 1 << 20;
  const std::int64_t at = first + number * step;
  const std::int64_t above = at < -kRim ? -kRim : at;
  return above > kRim ? kRim : above;
}

/// Sets how much the tool covers of kCoverGroup voxels from `lane` on. Bit i of the result: voxel i
/// is covered.
[[gnu::always_inline]] inline std::uint32_t cover_lanes(
    const CoverRow& row, std::int32_t lane, std::uint32_t (&covered)[kCoverGroup]) noexcept {
  std::uint32_t lanes = 0;
  for (std::int32_t i = 0; i < kCoverGroup; ++i) {
    const std::int32_t rho = row.density[lane + i] + 32768;
    covered[i] = static_cast<std::uint32_t>(-row.ratio[lane + i]) * static_cast<std::uint32_t>(rho);
    lanes |= covered[i] != 0 ? 1U << i : 0U;
  }
  return lanes;
}

/// Weighs the next group of the row from voxel `lane` on; `lane` moves to the begin of the
/// group. `sums` are over the group, by number in it. Returns false, and sets nothing, if the tool
/// covers none of the kCoverGroup voxels from `lane` on.
[[gnu::always_inline]] inline bool weigh_lanes(const CoverRow& row, std::int32_t& lane,
                                               CoveredGroup& group, CoverSums& sums) noexcept {
  std::uint32_t covered[kCoverGroup];
  const std::uint32_t lanes = cover_lanes(row, lane, covered);
  if (lanes == 0) return false;
  const std::int32_t begin = group_begin(row, lane, lanes);
  if (begin != lane) cover_lanes(row, lane = begin, covered);
  sums = {};
  for (std::int32_t i = 0; i < kCoverGroup; ++i) {
    const std::int64_t x = place_beside(row.place[0], row.step[0], lane + i);
    const std::int64_t z = place_beside(row.place[1], row.step[1], lane + i);
    constexpr std::int64_t kEnd = 1 << 25;
    const std::int64_t far = (x * x + z * z) >> 15, square = far < kEnd ? far : kEnd;
    const std::uint32_t root = row.roots[square >> 15];
    const std::uint32_t found =
        (root & 0xffff) + ((root >> 16) * static_cast<std::uint32_t>(square & 0x7fff) >> 15);
    const auto slowest = static_cast<std::uint32_t>(row.slowest);
    const std::uint32_t speed = found > slowest ? found : slowest;
    const auto weight = static_cast<std::uint32_t>(std::uint64_t{covered[i]} * speed >> 15);
    group.covered[i] = covered[i];
    group.weight[i] = weight;
    group.speed[i] = static_cast<std::uint16_t>(speed);
    sums.covered += covered[i];
    sums.covered_number += std::uint64_t{covered[i]} * static_cast<std::uint32_t>(i);
    sums.weight += weight;
    sums.weight_speed += std::uint64_t{weight} * speed;
  }
  return true;
}

/// Takes from the voxels of a group, densities `rho`, what `spend` allots to their materials.
[[gnu::always_inline]] inline TakenLanes take_lanes(const CoverSpend& spend, CoveredGroup& group,
                                                    std::uint16_t (&rho)[kCoverGroup]) noexcept {
  TakenLanes taken{};
  const auto phase = static_cast<std::uint32_t>(group.at) * spend.phase_by_voxel + spend.phase;
  for (std::uint32_t i = 0; i < kCoverGroup; ++i) {
    const std::uint64_t mantissa = spend.mantissa[group.material[i]];
    const std::uint64_t wanted = group.weight[i] * mantissa >> spend.shift[group.material[i]];
    const std::uint64_t most = std::uint64_t{group.covered[i]} << 1;  // below 2^32 - 2^16
    taken.full = taken.full || wanted > most;
    const auto part = static_cast<std::uint32_t>(wanted < most ? wanted : most);
    group.covered[i] -= part >> 1;
    const std::uint32_t own_phase = (phase + i * spend.phase_by_voxel) & 0xffff;
    const std::uint32_t steps = (part + own_phase) >> 16;
    const std::uint32_t lost = steps < rho[i] ? steps : rho[i];
    rho[i] = static_cast<std::uint16_t>(rho[i] - lost);
    taken.steps[i] = lost;
    taken.sum += lost;
    taken.lanes |= lost != 0 ? 1U << i : 0U;
  }
  return taken;
}

}  // namespace
}  // namespace kerf
