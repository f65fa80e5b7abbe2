// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/sets/set_common.hpp"

// The method `splat` as loops that a compiler turns into vectors, one text for every instruction
// set. Included after the set's own `filter_z`, `press_row` and `RowSums`; internal linkage, for
// the reason given at KernelSet.

namespace kerf {
namespace {

/// Places of all samples, and the lowest and highest low corner of their cells.
void place(const SampleTable& samples, const SamplePose& pose, const SplatScratch& scratch,
           VoxelIndex& lowest, VoxelIndex& highest) noexcept {
  std::int32_t low[3], high[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int32_t* out = scratch.place[axis];
    std::int32_t placed = 0;
    for (; placed < samples.count; placed += kSampleGroup) {
      place_along(samples, placed, pose.centre[axis], pose.step[axis], out + placed);
    }
    // Apart, so that it is a loop of vectors. The copies at the end do no harm.
    std::int32_t min = INT32_MAX, max = INT32_MIN;
    for (std::int32_t i = 0; i < placed; ++i) {
      min = out[i] < min ? out[i] : min;
      max = out[i] > max ? out[i] : max;
    }
    low[axis] = min >> 16;
    high[axis] = max >> 16;
  }
  lowest = {low[0], low[1], low[2]};
  highest = {high[0], high[1], high[2]};
}

/// Adds two weights to two neighbours at once. No sum reaches 2^32, so none carries into the other.
[[gnu::always_inline]] inline void add_pair(std::int32_t* at, const std::int32_t (&weight)[2]) {
  std::uint64_t sum, more;
  std::memcpy(&sum, at, sizeof sum);
  std::memcpy(&more, weight, sizeof more);
  sum += more;
  std::memcpy(at, &sum, sizeof sum);
}

/// The sums PHI_j of all voxels of the box. The box holds the cells of all samples.
void splat(const SampleTable& samples, const TickBox& box, VoxelIndex origin,
           const SplatScratch& scratch) noexcept {
  const std::ptrdiff_t row = box.row_lanes, plane = row * (box.size.y + 1);
  const std::ptrdiff_t corner[4] = {0, row, plane, plane + row};
  std::memset(scratch.sums, 0, static_cast<std::size_t>(plane * (box.size.z + 1)) * 4);
  for (std::int32_t first = 0; first < samples.count; first += kSampleGroup) {
    SampleCells cells;
    find_cells(scratch.place[0] + first, scratch.place[1] + first, scratch.place[2] + first, cells);
    alignas(64) std::int32_t at[kSampleGroup];
    alignas(64) std::int32_t pair[4][kSampleGroup][2];
    for (std::int32_t i = 0; i < kSampleGroup; ++i) {
      at[i] =
          ((cells.low[2][i] - origin.z - 2) * (box.size.y + 1) + cells.low[1][i] - origin.y - 2) *
              box.row_lanes +
          cells.low[0][i] - origin.x;
    }
    for (std::size_t q = 0; q < 4; ++q) {
      for (std::int32_t i = 0; i < kSampleGroup; ++i) {
        pair[q][i][0] = cells.weight[2 * q][i];
        pair[q][i][1] = cells.weight[2 * q + 1][i];
      }
    }
    const std::int32_t count =
        samples.count - first < kSampleGroup ? samples.count - first : kSampleGroup;
    for (std::int32_t i = 0; i < count; ++i) {
      std::int32_t* sum = scratch.sums + at[i];
      for (std::size_t q = 0; q < 4; ++q) add_pair(sum + corner[q], pair[q][i]);
    }
  }
}

/// The overlap ratio of a sum of weights, 0 where there is no density.
template <bool kUnit>
[[gnu::always_inline]] inline std::int32_t covered_part(std::int32_t sum, std::int16_t density,
                                                        std::int32_t volume_ratio) noexcept {
  constexpr std::int32_t kOne = 1 << 15;
  std::int32_t covered = sum;
  if constexpr (!kUnit) {
    const std::int64_t scaled = (std::int64_t{covered} * volume_ratio + (1 << 19)) >> 20;
    covered = static_cast<std::int32_t>(scaled < kOne ? scaled : kOne);
  }
  covered = covered < kOne ? covered : kOne;
  return density == INT16_MIN ? 0 : covered;
}

/// The parts of one row of sums: minus the overlap ratio if there is density, and minus the contact
/// sum beyond that, 15 bits at a time. Bit 0 is set if any ratio is left, bits 1 and 2 if any of
/// the rest is.
template <bool kUnit>
[[gnu::always_inline]] inline std::uint32_t split_row(const std::int32_t* sums,
                                                      const std::int16_t* density,
                                                      std::int32_t row_lanes,
                                                      std::int32_t volume_ratio,
                                                      std::int16_t* ratio, std::int16_t* low,
                                                      std::int16_t* high) noexcept {
  constexpr std::int32_t kOne = 1 << 15;
  std::int32_t any = 0, any_low = 0, any_high = 0;
  for (std::int32_t x = 0; x < row_lanes; ++x) {
    const std::int32_t covered = covered_part<kUnit>(sums[x], density[x], volume_ratio);
    const std::int32_t rest = kUnit ? sums[x] - covered : sums[x];
    const std::int32_t rest_low = rest & (kOne - 1), rest_high = rest >> 15;
    any |= covered;
    any_low |= rest_low;
    any_high |= rest_high;
    ratio[x] = static_cast<std::int16_t>(-covered);
    low[x] = static_cast<std::int16_t>(-rest_low);
    high[x] = static_cast<std::int16_t>(-rest_high);
  }
  return (any != 0 ? 1U : 0U) | (any_low != 0 ? 2U : 0U) | (any_high != 0 ? 4U : 0U);
}

/// Contact SUM PHI_j grad_j and modification SUM c_j grad_j of exact gradients. The overlaps c_j
/// stay in the scratch for the removal.
template <bool kUnit>
[[gnu::always_inline]] inline void press_sums_by(const TickBox& box, std::int32_t volume_ratio,
                                                 const SplatScratch& scratch,
                                                 std::int64_t (&contact)[3],
                                                 std::int64_t (&modification)[3]) noexcept {
  const std::ptrdiff_t row_lanes = box.row_lanes, padded = row_lanes + kRatioRowPad;
  const std::int32_t* const slopes = scratch.tick.filter + std::ptrdiff_t{box.box.y} * row_lanes;
  std::int16_t* const rest[2] = {scratch.rest[0] + kRatioRowPad, scratch.rest[1] + kRatioRowPad};
  for (std::int16_t* const rows : {scratch.tick.ratio, scratch.rest[0], scratch.rest[1]}) {
    for (std::int32_t x = 0; x < kRatioRowPad; ++x) rows[x] = 0;
  }
  RowSums cut, low, high;  // of one plane
  WideSum cut_sum[3], low_sum[3], high_sum[3];
  std::int16_t* ratio = scratch.tick.ratio + kRatioRowPad;
  const std::int32_t* sums = scratch.sums;
  std::uint8_t* live = scratch.tick.live;
  for (std::int32_t z = 0; z <= box.size.z; ++z) {
    std::int32_t first = box.size.y + 1, last = -1;
    std::int16_t* const plane_ratio = ratio;
    for (std::int32_t y = 0; y <= box.size.y; ++y, ratio += padded, sums += row_lanes, ++live) {
      const std::int16_t* density =
          scratch.tick.box + (std::ptrdiff_t{z + 2} * box.box.y + y + 2) * box.box.x;
      std::int16_t *rest_low = rest[0] + y * padded, *rest_high = rest[1] + y * padded;
      const std::uint32_t found =
          split_row<kUnit>(sums, density, box.row_lanes, volume_ratio, ratio, rest_low, rest_high);
      for (std::int32_t x = 0; x < kRatioRowPad; ++x) {
        ratio[row_lanes + x] = rest_low[row_lanes + x] = rest_high[row_lanes + x] = 0;
      }
      *live = found & 1;
      scratch.rest_live[y] = static_cast<std::uint8_t>(found);
      if (found == 0) continue;
      first = last < 0 ? y : first;
      last = y;
    }
    if (last < 0) continue;
    filter_z(box, box.row_lanes, scratch.tick, z, first, last);
    for (std::int32_t y = first; y <= last; ++y) {
      const std::int32_t* smooth = scratch.tick.filter + y * row_lanes;
      const std::int32_t* slope = slopes + y * row_lanes;
      const std::uint32_t found = scratch.rest_live[y];
      if (found & 1) press_row(box, box.row_lanes, plane_ratio + y * padded, smooth, slope, cut);
      if (found & 2) press_row(box, box.row_lanes, rest[0] + y * padded, smooth, slope, low);
      if (found & 4) press_row(box, box.row_lanes, rest[1] + y * padded, smooth, slope, high);
    }
    cut.settle(cut_sum, box.sum_shift);
    low.settle(low_sum, box.sum_shift);
    high.settle(high_sum, box.sum_shift);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const WideSum &c = cut_sum[axis], &l = low_sum[axis], &h = high_sum[axis];
    constexpr std::int64_t kHigh = std::int64_t{1} << 15;
    const WideSum all{(kUnit ? c.high : 0) + l.high + kHigh * h.high,
                      (kUnit ? c.low : 0) + l.low + kHigh * h.low};
    contact[axis] = all.over(box.sum_shift);
    modification[axis] = c.over(box.sum_shift);
  }
}

void press_sums(const TickBox& box, std::int32_t volume_ratio, const SplatScratch& scratch,
                std::int64_t (&contact)[3], std::int64_t (&modification)[3]) noexcept {
  if (volume_ratio == 1 << 20) {
    press_sums_by<true>(box, volume_ratio, scratch, contact, modification);
  } else {
    press_sums_by<false>(box, volume_ratio, scratch, contact, modification);
  }
}

template <bool kUnit>
[[gnu::always_inline]] inline void cover_sums_by(const TickBox& box, std::int32_t volume_ratio,
                                                 const SplatScratch& scratch) noexcept {
  std::int16_t* ratio = scratch.tick.ratio + kRatioRowPad;
  const std::int32_t* sums = scratch.sums;
  std::uint8_t* live = scratch.tick.live;
  for (std::int32_t z = 0; z <= box.size.z; ++z) {
    for (std::int32_t y = 0; y <= box.size.y; ++y) {
      const std::int16_t* density =
          scratch.tick.box + (std::ptrdiff_t{z + 2} * box.box.y + y + 2) * box.box.x;
      std::int32_t any = 0;
      for (std::int32_t x = 0; x < box.row_lanes; ++x) {
        const std::int32_t covered = covered_part<kUnit>(sums[x], density[x], volume_ratio);
        any |= covered;
        ratio[x] = static_cast<std::int16_t>(-covered);
      }
      for (std::int32_t x = 0; x < kRatioRowPad; ++x) ratio[box.row_lanes + x] = 0;
      *live++ = any != 0 ? 1 : 0;
      ratio += box.row_lanes + kRatioRowPad;
      sums += box.row_lanes;
    }
  }
}

void cover_sums(const TickBox& box, std::int32_t volume_ratio,
                const SplatScratch& scratch) noexcept {
  if (volume_ratio == 1 << 20) {
    cover_sums_by<true>(box, volume_ratio, scratch);
  } else {
    cover_sums_by<false>(box, volume_ratio, scratch);
  }
}

}  // namespace
}  // namespace kerf
