// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/proxy/shell_table.hpp"
#include "controller/kernel/sets/shell_places.hpp"

// Sums of a shell for AVX2 and AVX-512, in the bits of shell_sums.hpp; `Simd` as in box_vector.hpp.
// A sample is a 32-bit entry; where densities meet, its halves are the voxels x and x + 1.

namespace kerf {
namespace {

constexpr std::int32_t kShellLanes = kLanes / 2;

/// 64-bit sums of products of 32-bit entries, even and odd ones together.
struct ShellWeights {
  V even, odd;

  explicit ShellWeights(V weight) noexcept : even(weight), odd(Simd::odd32(weight)) {}
  [[gnu::always_inline]] void add(V& sum, V value) const noexcept {
    sum = Simd::add64(sum, Simd::multiply_even(even, value));
    sum = Simd::add64(sum, Simd::multiply_even(odd, Simd::odd32(value)));
  }
};

struct ShellVectors {
  V weight = Simd::zero(), density = Simd::zero(), square = Simd::zero();
  V rise[3] = {Simd::zero(), Simd::zero(), Simd::zero()};
  V lever[3] = {Simd::zero(), Simd::zero(), Simd::zero()};
  V top = Simd::zero(), solid = Simd::zero();
};

/// a + (b - a) t of 15-bit entries of 16 bits.
[[gnu::always_inline]] inline V blend16(V a, V b, V t) noexcept {
  return Simd::add16(a, Simd::multiply_round(Simd::sub16(b, a), t));
}
/// The same along x, of the two halves of each 32 bits: near (1 - t) + far t. The weights are
/// negative: t - 2^15 and -t fit 16 bits, 2^15 would not.
[[gnu::always_inline]] inline V blend_halves(V pair, V weights) noexcept {
  return Simd::sra32<15>(Simd::sub32(Simd::set32(1 << 14), Simd::multiply_pairs(pair, weights)));
}

/// Where the cells of some samples are.
struct ShellCells {
  V voxel;    ///< index of the low corner, 0 outside
  V inside;   ///< all ones inside; not set where all are known to be
  V x, y, z;  ///< how far in: weights of `blend_halves`, then twice 16 bits
};

/// `kInside`: all are known to be in the volume.
template <bool kInside>
[[gnu::always_inline]] inline ShellCells shell_cells(const ShellPlaces<FixedNumbers>& places,
                                                     const std::int32_t (&centre)[3],
                                                     const VoxelGrid& grid,
                                                     std::int32_t first) noexcept {
  V low[3], in[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const V at = Simd::add32(Simd::load(places.offset[axis] + first), Simd::set32(centre[axis]));
    low[axis] = Simd::sra32<16>(at);
    in[axis] = Simd::srl32<1>(Simd::bit_and(at, Simd::set32(0xffff)));
  }
  const V row = Simd::add32(low[1], Simd::multiply32(low[2], Simd::set32(grid.ny)));
  ShellCells cells;
  cells.voxel = Simd::add32(low[0], Simd::multiply32(row, Simd::set32(grid.nx)));
  cells.x = Simd::sub32(Simd::bit_or(in[0], Simd::set32(0x8000)), Simd::sll32<16>(in[0]));
  cells.y = Simd::bit_or(in[1], Simd::sll32<16>(in[1]));
  cells.z = Simd::bit_or(in[2], Simd::sll32<16>(in[2]));
  if constexpr (!kInside) {
    // Negative where any is outside.
    V beyond = Simd::bit_or(low[0], Simd::bit_or(low[1], low[2]));
    beyond = Simd::bit_or(beyond, Simd::sub32(Simd::set32(grid.nx - 2), low[0]));
    beyond = Simd::bit_or(beyond, Simd::sub32(Simd::set32(grid.ny - 2), low[1]));
    beyond = Simd::bit_or(beyond, Simd::sub32(Simd::set32(grid.nz - 2), low[2]));
    cells.inside = Simd::bit_xor(Simd::sra32<31>(beyond), Simd::set32(-1));
    cells.voxel = Simd::bit_and(cells.voxel, cells.inside);
  }
  return cells;
}

/// `shell_sample` and `add_sample` of kShellLanes samples.
template <bool kRound, bool kInside>
[[gnu::always_inline]] inline void add_samples(const ShellTable<FixedNumbers>& table,
                                               const ShellPlaces<FixedNumbers>& places,
                                               const std::int32_t (&centre)[3],
                                               const ShellField& field, std::int32_t first,
                                               ShellVectors& sums) noexcept {
  const ShellCells cell = shell_cells<kInside>(places, centre, field.grid, first);
  const std::ptrdiff_t row = field.grid.nx, plane = row * field.grid.ny;
  const auto corner = [&](std::ptrdiff_t offset) {
    return Simd::srl16<1>(Simd::gather_pairs(field.density + offset, cell.voxel));
  };
  const V c00 = corner(0), c10 = corner(row), c01 = corner(plane), c11 = corner(plane + row);
  const V near_z = blend16(c00, c10, cell.y), far_z = blend16(c01, c11, cell.y);
  const V at = blend16(near_z, far_z, cell.z);
  V read = blend_halves(at, cell.x);
  if constexpr (!kInside) read = Simd::bit_and(read, cell.inside);
  const V scaled =
      Simd::srl32(Simd::multiply32(read, Simd::set32(static_cast<int>(field.scale.mantissa))),
                  field.scale.shift);
  const V strong = Simd::sra32<31>(Simd::sub32(Simd::set32(2047), scaled));
  const V r = Simd::bit_and(Simd::min32(scaled, Simd::set32(32767)), strong);
  if (!Simd::any(r)) return;

  const V r2 = Simd::srl32<14>(Simd::add32(Simd::multiply_pairs(r, r), Simd::set32(1 << 13)));
  const V r4 = Simd::multiply32(r2, r2);
  V w = r4;
  if constexpr (!kRound) {
    w = Simd::multiply32(Simd::srl32<16>(Simd::add32(r4, Simd::set32(1 << 15))), r2);
  }
  w = Simd::srl32<8>(w);
  const ShellWeights weights(w);
  sums.weight = Simd::add64(sums.weight, Simd::low32(weights.even));
  sums.weight = Simd::add64(sums.weight, weights.odd);
  weights.add(sums.density, r);
  if constexpr (!kRound) weights.add(sums.square, r2);
  V r3 = Simd::zero(), lift = w;
  if constexpr (kRound) {
    r3 = Simd::srl32<6>(Simd::multiply_pairs(Simd::srl32<1>(r2), r));
    lift = Simd::srl32<8>(Simd::multiply32(Simd::srl32<8>(r3), r2));
  }
  const ShellWeights lifts(lift);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lifts.add(sums.lever[axis], Simd::load(table.lever[axis] + first));
  }
  sums.top = Simd::max32(sums.top, r);
  sums.solid = Simd::add32(sums.solid, Simd::srl32<14>(r));

  // Only where the density is not clipped it has a gradient.
  const V open = Simd::sra32<31>(Simd::sub32(scaled, Simd::set32(32768)));
  V v = w;
  if constexpr (kRound) v = Simd::sub32(Simd::add32(Simd::add32(w, w), w), r3);
  v = Simd::bit_and(v, open);
  if (!Simd::any(v)) return;
  const V near_y = blend16(c00, c01, cell.z), far_y = blend16(c10, c11, cell.z);
  const V slope[3] = {Simd::multiply_pairs(at, Simd::pair16(-1, 1)),
                      blend_halves(Simd::sub16(far_y, near_y), cell.x),
                      blend_halves(Simd::sub16(far_z, near_z), cell.x)};
  const ShellWeights pulls(v);
  for (std::size_t axis = 0; axis < 3; ++axis) pulls.add(sums.rise[axis], slope[axis]);
}

/// `kInside`: the whole tool is. What fills the last group up is not, so that one is read with
/// care.
template <bool kRound, bool kInside>
[[gnu::always_inline]] inline void sum_shell_by(const ShellTable<FixedNumbers>& table,
                                                const ShellPlaces<FixedNumbers>& places,
                                                const std::int32_t (&centre)[3],
                                                const ShellField& field,
                                                ShellSums<FixedNumbers>& out) noexcept {
  ShellVectors sums;
  for (std::int32_t group = 0; group < table.groups; ++group) {
    if (field.free.at((centre[0] + places.middle[0][group]) >> 16,
                      (centre[1] + places.middle[1][group]) >> 16,
                      (centre[2] + places.middle[2][group]) >> 16) >= table.bricks[group]) {
      continue;
    }
    const std::int32_t first = group * kShellGroup, end = first + kShellGroup;
    for (std::int32_t i = first; i < end; i += kShellLanes) {
      if (kInside && end <= table.count) {
        add_samples<kRound, true>(table, places, centre, field, i, sums);
      } else {
        add_samples<kRound, false>(table, places, centre, field, i, sums);
      }
    }
  }
  out.weight = Simd::sum64(sums.weight);
  out.density = Simd::sum64(sums.density);
  out.square = Simd::sum64(sums.square);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.rise[axis] = Simd::sum64(sums.rise[axis]);
    out.lever[axis] = Simd::sum64(sums.lever[axis]);
  }
  alignas(64) std::int32_t top[kShellLanes], solid[kShellLanes];
  Simd::store(top, sums.top);
  Simd::store(solid, sums.solid);
  out.top = out.solid = 0;
  for (std::int32_t i = 0; i < kShellLanes; ++i) {
    out.top = top[i] > out.top ? top[i] : out.top;
    out.solid += solid[i];
  }
}

void sum_shell_samples(const ShellTable<FixedNumbers>& table,
                       const ShellPlaces<FixedNumbers>& places, const std::int32_t (&centre)[3],
                       const ShellField& field, ShellSums<FixedNumbers>& sums) noexcept {
  const std::int32_t size[3] = {field.grid.nx, field.grid.ny, field.grid.nz};
  bool has_cells = true, inside = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    has_cells = has_cells && size[axis] > 1;
    inside = inside && centre[axis] >= table.reach &&
             (centre[axis] + table.reach) >> 16 < size[axis] - 1;
  }
  if (!has_cells) {  // no voxel that a sample outside could read in its place
    sums = {};
  } else if (table.round) {
    inside ? sum_shell_by<true, true>(table, places, centre, field, sums)
           : sum_shell_by<true, false>(table, places, centre, field, sums);
  } else {
    inside ? sum_shell_by<false, true>(table, places, centre, field, sums)
           : sum_shell_by<false, false>(table, places, centre, field, sums);
  }
}

}  // namespace
}  // namespace kerf
