// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/aligned_kernels.hpp"

// The vector kernels of the plan `aligned`, one text for AVX2, AVX-512 and NEON. Included only by
// their translation units, each of which defines `Simd`: a vector type V and its operations. All of
// it has internal linkage, for the reason told at AlignedKernels.

namespace kerf {
namespace {

constexpr std::int32_t kLanes = Simd::kLanes;
using V = Simd::V;

constexpr std::int16_t kAir = -32768;  ///< density 0 after re-centring

/// Visible to the optimiser only: accumulators in an array stay in registers when every loop over
/// them is gone before they are placed.
#if defined(__clang__)
#define KERF_UNROLL _Pragma("clang loop unroll(full)")
#else
#define KERF_UNROLL _Pragma("GCC unroll 32")
#endif

/// `count` densities of a row, re-centred, as whole vectors.
[[gnu::always_inline]] inline void copy_row(const Density* row, std::int32_t count,
                                            std::int16_t* out) noexcept {
  const V flip = Simd::set16(kAir);
  for (std::int32_t x = 0; x < count; x += kLanes) {
    Simd::store(out + x, Simd::bit_xor(Simd::load(row + x), flip));
  }
}

/// A box that sticks out of the volume, or whose last vectors would leave the volume's memory.
void copy_clipped_box(const TickBox& tool, const VoxelGrid& grid, const Density* density,
                      VoxelIndex origin, const AlignedScratch& scratch,
                      std::int32_t padded) noexcept {
  const V flip = Simd::set16(kAir);
  const std::int32_t width = tool.box.x;
  const std::int32_t from = origin.x < 0 ? -origin.x : 0;
  const std::int32_t to = grid.nx - origin.x < width ? grid.nx - origin.x : width;
  for (std::int32_t x = 0; x < padded; ++x) {
    scratch.inside[x] = static_cast<std::int16_t>(x >= from && x < to ? -1 : 0);
  }
  const std::ptrdiff_t pitch = grid.nx, plane = pitch * grid.ny, count = plane * grid.nz;
  std::int16_t* out = scratch.box;
  for (std::int32_t z = origin.z; z < origin.z + tool.box.z; ++z) {
    for (std::int32_t y = origin.y; y < origin.y + tool.box.y; ++y, out += width) {
      if (y < 0 || z < 0 || y >= grid.ny || z >= grid.nz) {
        for (std::int32_t x = 0; x < padded; x += kLanes) Simd::store(out + x, flip);
        continue;
      }
      const std::ptrdiff_t begin = z * plane + y * pitch + origin.x;
      if (begin < 0 || begin + padded > count) {  // whole vectors would leave the volume's memory
        for (std::int32_t x = 0; x < width; ++x) {
          out[x] = scratch.inside[x] != 0 ? static_cast<std::int16_t>(density[begin + x] ^ 0x8000)
                                          : kAir;
        }
        continue;
      }
      for (std::int32_t x = 0; x < padded; x += kLanes) {
        const V kept =
            Simd::bit_and(Simd::load(density + begin + x), Simd::load(scratch.inside + x));
        Simd::store(out + x, Simd::bit_xor(kept, flip));
      }
    }
  }
}

// Box rows are stored as whole vectors, in order: the next row overwrites what spills.
void copy_box(const TickBox& tool, const VoxelGrid& grid, const Density* density, VoxelIndex origin,
              const AlignedScratch& scratch) noexcept {
  const std::int32_t width = tool.box.x;
  const std::int32_t padded = (width + kLanes - 1) / kLanes * kLanes;
  const std::ptrdiff_t pitch = grid.nx, plane = pitch * grid.ny, count = plane * grid.nz;
  const VoxelIndex end{origin.x + width, origin.y + tool.box.y, origin.z + tool.box.z};
  const std::ptrdiff_t last_row = (end.z - 1) * plane + (end.y - 1) * pitch + origin.x;
  if (origin.x < 0 || origin.y < 0 || origin.z < 0 || end.x > grid.nx || end.y > grid.ny ||
      end.z > grid.nz || last_row + padded > count) {
    copy_clipped_box(tool, grid, density, origin, scratch, padded);
    return;
  }
  std::int16_t* out = scratch.box;
  for (std::int32_t z = origin.z; z < end.z; ++z) {
    const Density* row = density + z * plane + origin.y * pitch + origin.x;
    if (padded == 32) {  // tools up to 27 voxels: no loop within a row
      for (std::int32_t y = 0; y < tool.box.y; ++y, row += pitch, out += width) {
        copy_row(row, 32, out);
      }
    } else {
      for (std::int32_t y = 0; y < tool.box.y; ++y, row += pitch, out += width) {
        copy_row(row, padded, out);
      }
    }
  }
}

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

/// Five taps as pairs for multiply_add.
struct TapPairs {
  V ab, cd, e;
  TapPairs(const std::int32_t (&tap)[5], int sign) noexcept
      : ab(Simd::pair16(sign * tap[0], sign * tap[1])),
        cd(Simd::pair16(sign * tap[2], sign * tap[3])),
        e(Simd::pair16(sign * tap[4], 0)) {}

  [[gnu::always_inline]] V operator()(V p, V q, V r) const noexcept {
    V sum = Simd::zero();
    Simd::multiply_add(sum, p, ab);
    Simd::multiply_add(sum, q, cd);
    Simd::multiply_add(sum, r, e);
    return sum;
  }
};

/// Bits of mask words that meet vector `j` of a row.
[[gnu::always_inline]] inline std::uint32_t mask_bits(const std::uint32_t* words,
                                                      std::ptrdiff_t j) noexcept {
  constexpr std::ptrdiff_t kPerWord = 32 / kLanes;
  return words[j / kPerWord] >> (kLanes * (j % kPerWord)) & ~std::uint32_t{0} >> (32 - kLanes);
}

/// Overlap ratios of plane z, negative, 0 where the density is 0. Sets the range of live rows.
[[gnu::always_inline]] inline void overlap_plane(const AlignedTable& tool, std::int32_t row_lanes,
                                                 const V (&weight)[8],
                                                 const AlignedScratch& scratch, std::int32_t z,
                                                 std::int32_t& first, std::int32_t& last) noexcept {
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

/// Rows y first .. last + 4 of the five planes at z, filtered along z: smooth, then slope.
[[gnu::always_inline]] inline void filter_z(const TickBox& tool, std::int32_t row_lanes,
                                            const AlignedScratch& scratch, std::int32_t z,
                                            std::int32_t first, std::int32_t last) noexcept {
  const TapPairs smooth(tool.taps.smooth, 1), slope(tool.taps.slope, 1);
  const std::ptrdiff_t pitch = tool.box.x, plane = pitch * tool.box.y;
  std::int32_t* const slopes = scratch.filter + static_cast<std::ptrdiff_t>(tool.box.y) * row_lanes;
  for (std::int32_t y = first; y <= last + 4; ++y) {
    for (std::int32_t x = 0; x < row_lanes; x += kLanes) {
      const std::int16_t* d = scratch.box + z * plane + y * pitch + x;
      const V a = Simd::load(d), b = Simd::load(d + plane), c = Simd::load(d + 2 * plane),
              e = Simd::load(d + 3 * plane), f = Simd::load(d + 4 * plane);
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y) * row_lanes + x;
      const V p = Simd::unpack_low(a, b), q = Simd::unpack_low(c, e),
              r = Simd::unpack_low(f, Simd::zero());
      Simd::store(scratch.filter + at, smooth(p, q, r));
      Simd::store(slopes + at, slope(p, q, r));
      const V s = Simd::unpack_high(a, b), t = Simd::unpack_high(c, e),
              u = Simd::unpack_high(f, Simd::zero());
      Simd::store(scratch.filter + at + kLanes / 2, smooth(s, t, u));
      Simd::store(slopes + at + kLanes / 2, slope(s, t, u));
    }
  }
}

/// Sums of rows by axis, minus sign pending: the stored ratios are negative.
struct RowSums {
  V x = Simd::zero(), y = Simd::zero(), z = Simd::zero();

  /// Hands the rows so far over, at most those of a plane.
  [[gnu::always_inline]] void settle(WideSum (&sum)[3], int shift) noexcept {
    sum[0].add(-Simd::sum64(x), shift);
    sum[1].add(-Simd::sum64(y), shift);
    sum[2].add(-Simd::sum64(z), shift);
    x = y = z = Simd::zero();
  }
};

/// sum += a b for 32-bit entries, exact.
[[gnu::always_inline]] inline V add_products(V sum, V a, V b) noexcept {
  const V even = Simd::multiply_even(a, b);
  const V odd = Simd::multiply_even(Simd::odd32(a), Simd::odd32(b));
  return Simd::add64(sum, Simd::add64(even, odd));
}

/// One row's part of the modification sum. The x filter is applied to the ratios, not to the data:
/// the dot product is the same, the ratios have 16 bits, and one filter serves all axes. Unpacking
/// mixes the order of entries, on both sides alike.
[[gnu::always_inline]] inline void press_row(const TickBox& box, std::int32_t row_lanes,
                                             const std::int16_t* ratio,
                                             const std::int32_t* smooth_z,
                                             const std::int32_t* slope_z, RowSums& sum) noexcept {
  const AlignedTaps& taps = box.taps;
  const TapPairs smooth(taps.smooth, 1), slope_back(taps.slope, -1);
  const V outer = Simd::set32(taps.smooth[4]), inner = Simd::set32(taps.smooth[3]),
          middle = Simd::set32(taps.smooth[2]);
  const V steep_outer = Simd::set32(taps.slope[4]), steep_inner = Simd::set32(taps.slope[3]);
  const std::ptrdiff_t pitch = row_lanes;
  const auto smooth_y = [&](const std::int32_t* p) __attribute__((always_inline)) {
    const V a = Simd::load(p), b = Simd::load(p + pitch), c = Simd::load(p + 2 * pitch),
            d = Simd::load(p + 3 * pitch), e = Simd::load(p + 4 * pitch);
    return Simd::add32(Simd::add32(Simd::multiply32(Simd::add32(a, e), outer),
                                   Simd::multiply32(Simd::add32(b, d), inner)),
                       Simd::multiply32(c, middle));
  };
  const auto slope_y = [&](const std::int32_t* p) __attribute__((always_inline)) {
    const V a = Simd::load(p), b = Simd::load(p + pitch), d = Simd::load(p + 3 * pitch),
            e = Simd::load(p + 4 * pitch);
    return Simd::add32(Simd::multiply32(Simd::sub32(e, a), steep_outer),
                       Simd::multiply32(Simd::sub32(d, b), steep_inner));
  };
  for (std::int32_t x = 0; x < row_lanes; x += kLanes) {
    const V a = Simd::load(ratio + x - 2), b = Simd::load(ratio + x - 1), c = Simd::load(ratio + x),
            d = Simd::load(ratio + x + 1), e = Simd::load(ratio + x + 2);
    const V first[2] = {Simd::unpack_low(a, b), Simd::unpack_high(a, b)};
    const V second[2] = {Simd::unpack_low(c, d), Simd::unpack_high(c, d)};
    const V third[2] = {Simd::unpack_low(e, Simd::zero()), Simd::unpack_high(e, Simd::zero())};
    KERF_UNROLL
    for (int half = 0; half < 2; ++half) {
      const std::int32_t at = x + half * kLanes / 2;
      const V along = smooth(first[half], second[half], third[half]);
      const V across = slope_back(first[half], second[half], third[half]);
      sum.x = add_products(sum.x, smooth_y(smooth_z + at), across);
      sum.y = add_products(sum.y, slope_y(smooth_z + at), along);
      sum.z = add_products(sum.z, smooth_y(slope_z + at), along);
    }
  }
}

// The table is a copy, so that no store through a pointer can be thought to change it.
[[gnu::always_inline]] inline void press_rows(AlignedTable tool, std::int32_t row_lanes,
                                              const std::int32_t (&weights)[8],
                                              AlignedScratch scratch,
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

void press(const AlignedTable& tool, const std::int32_t (&weights)[8],
           const AlignedScratch& scratch, std::int64_t (&sum)[3]) noexcept {
  if (tool.row_lanes == 32) {  // tools up to 27 voxels: no loop within a row
    press_rows(tool, 32, weights, scratch, sum);
  } else {
    press_rows(tool, tool.row_lanes, weights, scratch, sum);
  }
}

/// What leaves each voxel of a vector: (rho * (r m >> 15) * 2^-exponent + owed) >> 16 with 32-bit
/// intermediates held as two 16-bit halves. `owed` keeps the low half.
[[gnu::always_inline]] inline V taken(V rho, V ratio, V mantissa, std::int32_t exponent,
                                      V& owed) noexcept {
  const V w = Simd::bit_or(Simd::shift_left16(Simd::multiply_high(ratio, mantissa), 1),
                           Simd::shift_right16(Simd::multiply_low(ratio, mantissa), 15));
  V high = Simd::multiply_high(rho, w), low = Simd::multiply_low(rho, w);
  if (exponent == 0) {
    high = Simd::bit_or(Simd::shift_left16(high, 1), Simd::shift_right16(low, 15));
    low = Simd::shift_left16(low, 1);
  } else {  // a shift by 16 or more, or by a negative count, gives 0
    const std::int32_t s = exponent - 1;
    low = Simd::bit_or(
        Simd::shift_right16(low, s),
        Simd::bit_or(Simd::shift_left16(high, 16 - s), Simd::shift_right16(high, s - 16)));
    high = Simd::shift_right16(high, s);
  }
  const V sum = Simd::add16(low, owed);
  owed = sum;
  return Simd::add_carry(high, sum, low);
}

[[gnu::always_inline]] inline AlignedCut cut_rows(TickBox tool, std::int32_t row_lanes,
                                                  AlignedRate rate, VoxelGrid grid,
                                                  Density* density, VoxelIndex origin,
                                                  AlignedScratch scratch,
                                                  std::uint16_t* carry) noexcept {
  AlignedCut cut{0, {tool.box.x, tool.box.y, tool.box.z}, {-1, -1, -1}};
  const V air = Simd::set16(kAir), mantissa = Simd::set16(rate.mantissa);
  const std::ptrdiff_t pitch = grid.nx, plane = pitch * grid.ny, count = plane * grid.nz;
  const std::ptrdiff_t ratio_pitch = row_lanes + kRatioRowPad;
  for (std::int32_t x = 0; x < row_lanes; x += kLanes) {  // a lane never leaves its vector
    V owed = Simd::load(carry + x), steps = Simd::zero();
    std::uint32_t changed = 0;
    for (std::int32_t z = 0; z <= tool.size.z; ++z) {
      const std::uint8_t* live = scratch.live + std::ptrdiff_t{z} * (tool.size.y + 1);
      const std::int16_t* ratio = scratch.ratio + kRatioRowPad + x +
                                  static_cast<std::ptrdiff_t>(z) * (tool.size.y + 1) * ratio_pitch;
      const std::int16_t* box =
          scratch.box + (static_cast<std::ptrdiff_t>(z + 2) * tool.box.y + 2) * tool.box.x + x;
      std::ptrdiff_t begin = (origin.z + z + 2) * plane + (origin.y + 2) * pitch + origin.x + x;
      std::int32_t first = tool.box.y, last = -1;
      for (std::int32_t y = 0; y <= tool.size.y;
           ++y, ratio += ratio_pitch, box += tool.box.x, begin += pitch) {
        if (live[y] == 0) continue;
        const V rho = Simd::bit_xor(Simd::load(box), air);
        const V loss =
            taken(rho, Simd::sub16(Simd::zero(), Simd::load(ratio)), mantissa, rate.exponent, owed);
        const std::uint32_t lost = Simd::not_zero16(loss);
        if (lost == 0) continue;
        steps = Simd::add32(steps, Simd::add32(Simd::unpack_low(loss, Simd::zero()),
                                               Simd::unpack_high(loss, Simd::zero())));
        changed |= lost;
        first = last < 0 ? y : first;
        last = y;
        Simd::write_loss(density, begin, count, rho, loss, lost);
      }
      if (last < 0) continue;
      cut.lo.y = first + 2 < cut.lo.y ? first + 2 : cut.lo.y;
      cut.hi.y = last + 2 > cut.hi.y ? last + 2 : cut.hi.y;
      cut.lo.z = z + 2 < cut.lo.z ? z + 2 : cut.lo.z;
      cut.hi.z = z + 2 > cut.hi.z ? z + 2 : cut.hi.z;
    }
    Simd::store(carry + x, owed);
    cut.density_steps += static_cast<std::uint64_t>(Simd::sum64(Simd::widened(steps)));
    if (changed == 0) continue;
    const std::int32_t low = x + __builtin_ctz(changed), high = x + 31 - __builtin_clz(changed);
    cut.lo.x = low < cut.lo.x ? low : cut.lo.x;
    cut.hi.x = high > cut.hi.x ? high : cut.hi.x;
  }
  return cut;
}

AlignedCut cut(const TickBox& tool, const AlignedRate& rate, const VoxelGrid& grid,
               Density* density, VoxelIndex origin, const AlignedScratch& scratch,
               std::uint16_t* carry) noexcept {
  if (tool.row_lanes == 32) return cut_rows(tool, 32, rate, grid, density, origin, scratch, carry);
  return cut_rows(tool, tool.row_lanes, rate, grid, density, origin, scratch, carry);
}

}  // namespace
}  // namespace kerf
