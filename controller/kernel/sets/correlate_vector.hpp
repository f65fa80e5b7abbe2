// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/sets/box_vector.hpp"

// The vector kernels of the method `aligned`: correlation and overlap by tables. As box_vector.hpp.

namespace kerf {
namespace {

/// Sums of `Corners` corners and `Axes` axes over one list of chunks: corner k at `corner[k]`.
/// 32-bit sums of the low and high table halves, widened before they can overflow.
template <int Axes, int Corners>
[[gnu::always_inline]] inline void correlate_list(const AlignedTable& tool, std::int32_t list,
                                                  const std::int16_t* box,
                                                  const std::ptrdiff_t (&corner)[Corners],
                                                  std::int64_t (&sum)[Axes][Corners]) noexcept {
  constexpr int kSums = Axes * Corners;
  V wide[kSums];
  for (int i = 0; i < kSums; ++i) wide[i] = Simd::zero();
  const AlignedChunk* chunk = tool.chunks[list];
  const AlignedChunk* const end = chunk + tool.chunk_count[list];
  while (chunk != end) {
    const AlignedChunk* const stop = end - chunk > tool.flush ? chunk + tool.flush : end;
    V low[kSums], high[kSums];
    KERF_UNROLL
    for (int i = 0; i < kSums; ++i) low[i] = high[i] = Simd::zero();
    for (; chunk != stop; ++chunk) {
      const std::int16_t* entry = tool.vectors + chunk->vector;
      const std::int16_t* place = box + chunk->box_at;
      V table[2 * Axes];
      KERF_UNROLL
      for (int i = 0; i < 2 * Axes; ++i) table[i] = Simd::load(entry + std::ptrdiff_t{i} * kLanes);
      KERF_UNROLL
      for (int c = 0; c < Corners; ++c) {
        const V density = Simd::load(place + corner[c]);
        KERF_UNROLL
        for (int a = 0; a < Axes; ++a) {
          Simd::multiply_add(low[a * Corners + c], table[2 * a], density);
          Simd::multiply_add(high[a * Corners + c], table[2 * a + 1], density);
        }
      }
    }
    KERF_UNROLL
    for (int i = 0; i < kSums; ++i) {
      wide[i] = Simd::add64(
          wide[i], Simd::add64(Simd::widened(low[i]), Simd::times512(Simd::widened(high[i]))));
    }
  }
  for (int a = 0; a < Axes; ++a) {
    for (int c = 0; c < Corners; ++c) sum[a][c] = Simd::sum64(wide[a * Corners + c]);
  }
}

void correlate(const AlignedTable& tool, const std::int16_t* box,
               std::int64_t (&sum)[3][8]) noexcept {
  const std::ptrdiff_t pitch = tool.box.x, plane = pitch * tool.box.y;
  if constexpr (kLanes == 32) {  // 32 registers
    if (tool.fused) {
      for (int half = 0; half < 2; ++half) {
        const std::ptrdiff_t corner[4] = {half * plane, half * plane + 1, half * plane + pitch,
                                          half * plane + pitch + 1};
        std::int64_t part[3][4];
        correlate_list<3, 4>(tool, 0, box, corner, part);
        for (int a = 0; a < 3; ++a) {
          for (int c = 0; c < 4; ++c) sum[a][4 * half + c] = part[a][c];
        }
      }
      return;
    }
    const std::ptrdiff_t corner[8] = {0,     1,         pitch,         pitch + 1,
                                      plane, plane + 1, plane + pitch, plane + pitch + 1};
    for (int a = 0; a < 3; ++a) {
      std::int64_t part[1][8];
      correlate_list<1, 8>(tool, a, box, corner, part);
      for (int c = 0; c < 8; ++c) sum[a][c] = part[0][c];
    }
  } else {  // 16 registers, or as many sums in flight as NEON needs
    const std::ptrdiff_t corner[4] = {0, pitch, plane, plane + pitch};
    for (int a = 0; a < 3; ++a) {
      for (int half = 0; half < 2; ++half) {
        std::int64_t part[1][4];
        correlate_list<1, 4>(tool, a, box + half, corner, part);
        for (int c = 0; c < 4; ++c) sum[a][2 * c + half] = part[0][c];
      }
    }
  }
}

/// Bits of mask words that meet vector `j` of a row.
[[gnu::always_inline]] inline std::uint32_t mask_bits(const std::uint32_t* words,
                                                      std::ptrdiff_t j) noexcept {
  constexpr std::ptrdiff_t kPerWord = 32 / kLanes;
  return words[j / kPerWord] >> (kLanes * (j % kPerWord)) & ~std::uint32_t{0} >> (32 - kLanes);
}

/// Overlap ratios of plane z, negative, 0 where the density is 0. Sets the range of live rows.
[[gnu::always_inline]] inline void overlap_plane(const AlignedTable& tool, std::int32_t row_lanes,
                                                 const V (&weight)[8], const BoxScratch& scratch,
                                                 std::int32_t z, std::int32_t& first,
                                                 std::int32_t& last) noexcept {
  const std::int32_t words = row_lanes / 32;
  const std::int32_t mask_rows = tool.size.y + 2;
  const V air = Simd::set16(kAir);
  first = tool.size.y + 1;
  last = -1;
  for (std::int32_t y = 0; y <= tool.size.y; ++y) {
    const std::int32_t row = z * (tool.size.y + 1) + y;
    std::int16_t* ratio = scratch.ratio + kRatioRowPad +
                          static_cast<std::ptrdiff_t>(row) * (row_lanes + kRatioRowPad);
    const std::int16_t* density =
        scratch.box + (static_cast<std::ptrdiff_t>(z + 2) * tool.box.y + y + 2) * tool.box.x;
    const std::uint32_t* bits[4];  // the rows that a corner y, z reaches
    for (int c = 0; c < 4; ++c) {
      const std::int32_t from = (z + 1 - (c >> 1)) * mask_rows + y + 1 - (c & 1);
      bits[c] = tool.mask + static_cast<std::ptrdiff_t>(from) * 2 * words;
    }
    std::uint32_t any = 0;
    for (std::ptrdiff_t j = 0; j < row_lanes / kLanes; ++j) {
      V sum = Simd::zero();
      KERF_UNROLL
      for (std::size_t c = 0; c < 4; ++c) {
        sum = Simd::add_where(sum, mask_bits(bits[c], j), weight[2 * c]);
        sum = Simd::add_where(sum, mask_bits(bits[c] + words, j), weight[2 * c + 1]);
      }
      sum = Simd::zero_where_equal(sum, Simd::load(density + j * kLanes), air);
      any |= Simd::not_zero16(sum);
      Simd::store(ratio + j * kLanes, Simd::sub16(Simd::zero(), sum));
    }
    for (std::int32_t x = 0; x < kRatioRowPad; ++x) ratio[row_lanes + x] = 0;
    scratch.live[row] = any != 0 ? 1 : 0;
    if (any == 0) continue;
    if (last < 0) first = y;
    last = y;
  }
}

// The table is a copy, so that no store through a pointer can be thought to change it.
[[gnu::always_inline]] inline void press_rows(AlignedTable tool, std::int32_t row_lanes,
                                              const std::int32_t (&weights)[8], BoxScratch scratch,
                                              std::int64_t (&sum)[3]) noexcept {
  V weight[8];
  for (int c = 0; c < 8; ++c) weight[c] = Simd::set16(weights[c]);
  for (std::int32_t x = 0; x < kRatioRowPad; ++x) scratch.ratio[x] = 0;
  const std::int32_t* const slopes =
      scratch.filter + static_cast<std::ptrdiff_t>(tool.box.y) * row_lanes;
  RowSums plane;
  WideSum total[3];
  for (std::int32_t z = 0; z <= tool.size.z; ++z) {
    std::int32_t first = 0, last = -1;
    overlap_plane(tool, row_lanes, weight, scratch, z, first, last);
    if (last < 0) continue;
    filter_z(tool, row_lanes, scratch, z, first, last);
    for (std::int32_t y = first; y <= last; ++y) {
      const std::int32_t row = z * (tool.size.y + 1) + y;
      if (scratch.live[row] == 0) continue;
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y) * row_lanes;
      press_row(tool, row_lanes,
                scratch.ratio + kRatioRowPad +
                    static_cast<std::ptrdiff_t>(row) * (row_lanes + kRatioRowPad),
                scratch.filter + at, slopes + at, plane);
    }
    plane.settle(total, tool.sum_shift);
  }
  for (int axis = 0; axis < 3; ++axis) sum[axis] = total[axis].over(tool.sum_shift);
}

[[gnu::always_inline]] inline void cover_rows(AlignedTable tool, std::int32_t row_lanes,
                                              const std::int32_t (&weights)[8],
                                              BoxScratch scratch) noexcept {
  V weight[8];
  for (int c = 0; c < 8; ++c) weight[c] = Simd::set16(weights[c]);
  std::int32_t first = 0, last = -1;
  for (std::int32_t z = 0; z <= tool.size.z; ++z) {
    overlap_plane(tool, row_lanes, weight, scratch, z, first, last);
  }
}

void cover(const AlignedTable& tool, const std::int32_t (&weights)[8],
           const BoxScratch& scratch) noexcept {
  if (tool.row_lanes == 32) {
    cover_rows(tool, 32, weights, scratch);
  } else {
    cover_rows(tool, tool.row_lanes, weights, scratch);
  }
}

void press(const AlignedTable& tool, const std::int32_t (&weights)[8], const BoxScratch& scratch,
           std::int64_t (&sum)[3]) noexcept {
  if (tool.row_lanes == 32) {  // tools up to 27 voxels: no loop within a row
    press_rows(tool, 32, weights, scratch, sum);
  } else {
    press_rows(tool, tool.row_lanes, weights, scratch, sum);
  }
}

}  // namespace
}  // namespace kerf
