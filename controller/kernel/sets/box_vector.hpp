// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/kernel_set.hpp"

// The box of voxels of the methods `aligned` and `splat`: one text for AVX2, AVX-512 and NEON.
// Included only by their translation units, each of which defines `Simd`: a vector type V and its
// operations. All of it has internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

constexpr std::int32_t kLanes = Simd::kLanes;
using V = Simd::V;

constexpr std::int16_t kAir = -32768;  ///< density 0 after re-centring

/// Unrolls a loop completely: accumulators in an array stay in registers only if no loop over them
/// is left when the compiler assigns registers. Changes no result.
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
void copy_clipped_box(const TickBox& area, const VoxelGrid& grid, const Density* density,
                      VoxelIndex origin, const BoxScratch& scratch, std::int32_t padded) noexcept {
  const V flip = Simd::set16(kAir);
  const std::int32_t width = area.box.x;
  const std::int32_t from = origin.x < 0 ? -origin.x : 0;
  const std::int32_t to = grid.nx - origin.x < width ? grid.nx - origin.x : width;
  for (std::int32_t x = 0; x < padded; ++x) {
    scratch.inside[x] = static_cast<std::int16_t>(x >= from && x < to ? -1 : 0);
  }
  const std::ptrdiff_t pitch = grid.nx, plane = pitch * grid.ny, count = plane * grid.nz;
  std::int16_t* out = scratch.box;
  for (std::int32_t z = origin.z; z < origin.z + area.box.z; ++z) {
    for (std::int32_t y = origin.y; y < origin.y + area.box.y; ++y, out += width) {
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
void copy_box(const TickBox& area, const VoxelGrid& grid, const Density* density, VoxelIndex origin,
              const BoxScratch& scratch) noexcept {
  const std::int32_t width = area.box.x;
  const std::int32_t padded = (width + kLanes - 1) / kLanes * kLanes;
  const std::ptrdiff_t pitch = grid.nx, plane = pitch * grid.ny, count = plane * grid.nz;
  const VoxelIndex end{origin.x + width, origin.y + area.box.y, origin.z + area.box.z};
  const std::ptrdiff_t last_row = (end.z - 1) * plane + (end.y - 1) * pitch + origin.x;
  if (origin.x < 0 || origin.y < 0 || origin.z < 0 || end.x > grid.nx || end.y > grid.ny ||
      end.z > grid.nz || last_row + padded > count) {
    copy_clipped_box(area, grid, density, origin, scratch, padded);
    return;
  }
  std::int16_t* out = scratch.box;
  for (std::int32_t z = origin.z; z < end.z; ++z) {
    const Density* row = density + z * plane + origin.y * pitch + origin.x;
    if (padded == 32) {  // tools up to 27 voxels: no loop within a row
      for (std::int32_t y = 0; y < area.box.y; ++y, row += pitch, out += width) {
        copy_row(row, 32, out);
      }
    } else {
      for (std::int32_t y = 0; y < area.box.y; ++y, row += pitch, out += width) {
        copy_row(row, padded, out);
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

/// Rows y first .. last + 4 of the five planes at z, filtered along z: smooth, then slope.
[[gnu::always_inline]] inline void filter_z(const TickBox& area, std::int32_t row_lanes,
                                            const BoxScratch& scratch, std::int32_t z,
                                            std::int32_t first, std::int32_t last) noexcept {
  const TapPairs smooth(area.taps.smooth, 1), slope(area.taps.slope, 1);
  const std::ptrdiff_t pitch = area.box.x, plane = pitch * area.box.y;
  std::int32_t* const slopes = scratch.filter + static_cast<std::ptrdiff_t>(area.box.y) * row_lanes;
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
  const ExactTaps& taps = box.taps;
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

/// Removal from each voxel of a vector: (rho * (c m >> 15) * 2^-exponent + owed) >> 16 with 32-bit
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

[[gnu::always_inline]] inline BoxCut cut_rows(TickBox area, std::int32_t row_lanes, CutRate rate,
                                              VoxelGrid grid, Density* density, VoxelIndex origin,
                                              BoxScratch scratch, std::uint16_t* carry) noexcept {
  BoxCut cut{0, {area.box.x, area.box.y, area.box.z}, {-1, -1, -1}};
  const V air = Simd::set16(kAir), mantissa = Simd::set16(rate.mantissa);
  const std::ptrdiff_t pitch = grid.nx, plane = pitch * grid.ny, count = plane * grid.nz;
  const std::ptrdiff_t ratio_pitch = row_lanes + kRatioRowPad;
  for (std::int32_t x = 0; x < row_lanes; x += kLanes) {         // a lane never leaves its vector
    V owed = Simd::load(carry + x), taken_steps = Simd::zero();  // of 64 bits
    std::uint32_t changed = 0;
    for (std::int32_t z = 0; z <= area.size.z; ++z) {
      const std::uint8_t* live = scratch.live + std::ptrdiff_t{z} * (area.size.y + 1);
      const std::int16_t* ratio = scratch.ratio + kRatioRowPad + x +
                                  static_cast<std::ptrdiff_t>(z) * (area.size.y + 1) * ratio_pitch;
      const std::int16_t* box =
          scratch.box + (static_cast<std::ptrdiff_t>(z + 2) * area.box.y + 2) * area.box.x + x;
      std::ptrdiff_t begin = (origin.z + z + 2) * plane + (origin.y + 2) * pitch + origin.x + x;
      std::int32_t first = area.box.y, last = -1;
      V steps = Simd::zero();  // of 32 bits: up to 16 384 rows
      for (std::int32_t y = 0; y <= area.size.y;
           ++y, ratio += ratio_pitch, box += area.box.x, begin += pitch) {
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
      taken_steps = Simd::add64(taken_steps, Simd::widened(steps));
      cut.lo.y = first + 2 < cut.lo.y ? first + 2 : cut.lo.y;
      cut.hi.y = last + 2 > cut.hi.y ? last + 2 : cut.hi.y;
      cut.lo.z = z + 2 < cut.lo.z ? z + 2 : cut.lo.z;
      cut.hi.z = z + 2 > cut.hi.z ? z + 2 : cut.hi.z;
    }
    Simd::store(carry + x, owed);
    cut.density_steps += static_cast<std::uint64_t>(Simd::sum64(taken_steps));
    if (changed == 0) continue;
    const std::int32_t low = x + __builtin_ctz(changed), high = x + 31 - __builtin_clz(changed);
    cut.lo.x = low < cut.lo.x ? low : cut.lo.x;
    cut.hi.x = high > cut.hi.x ? high : cut.hi.x;
  }
  return cut;
}

BoxCut cut(const TickBox& area, const CutRate& rate, const VoxelGrid& grid, Density* density,
           VoxelIndex origin, const BoxScratch& scratch, std::uint16_t* carry) noexcept {
  if (area.row_lanes == 32) return cut_rows(area, 32, rate, grid, density, origin, scratch, carry);
  return cut_rows(area, area.row_lanes, rate, grid, density, origin, scratch, carry);
}

}  // namespace
}  // namespace kerf
