// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/sets/box_vector.hpp"
#include "controller/kernel/sets/set_common.hpp"

// Sums of a point shell and of close samples for AVX2, AVX-512 and SIMD128, in the bits of
// point_sums.hpp; `Simd` as in box_vector.hpp. Each sample fills a 32-bit lane. While densities are
// blended, its two halves hold voxels x and x + 1.

namespace kerf {
namespace {

constexpr std::int32_t kPointLanes = kLanes / 2;
constexpr int kSampleBits = 13;
static_assert(kMaxShellPoints == 1 << kSampleBits);

/// 64-bit sums of products of 32-bit entries, even and odd ones together.
struct PointWeights {
  V even, odd;

  explicit PointWeights(V weight) noexcept : even(weight), odd(Simd::odd32(weight)) {}
  [[gnu::always_inline]] void count(V& sum) const noexcept {
    sum = Simd::add64(Simd::add64(sum, Simd::low32(even)), odd);
  }
  [[gnu::always_inline]] void add(V& sum, V value) const noexcept {
    sum = Simd::add64(sum, Simd::multiply_even(even, value));
    sum = Simd::add64(sum, Simd::multiply_even(odd, Simd::odd32(value)));
  }
};

struct PointVectors {
  V weight = Simd::zero(), density = Simd::zero(), square = Simd::zero();
  V gradient[3] = {Simd::zero(), Simd::zero(), Simd::zero()};
  V offset[3] = {Simd::zero(), Simd::zero(), Simd::zero()};
  V high = Simd::zero(), high_offset[3] = {Simd::zero(), Simd::zero(), Simd::zero()};
  V top = Simd::zero();                                           ///< r 2^kSampleBits + sample
  V full_offset[3] = {Simd::zero(), Simd::zero(), Simd::zero()};  ///< of vectors of full density
  std::int32_t full = 0;                                          ///< samples in such vectors
  std::int32_t read = 0;
};

/// One sample of full density whose offset is (1, 0, 0).
template <bool kRound>
inline constexpr PointSums<FixedNumbers> kFullSample = [] {
  PointSums<FixedNumbers> sums;
  add_sample<FixedNumbers>(sums, 0, {32767, {}}, {1, 0, 0}, kRound);
  return sums;
}();

/// a + (b - a) t of 15-bit entries of 16 bits.
[[gnu::always_inline]] inline V blend16(V a, V b, V t) noexcept {
  return Simd::add16(a, Simd::multiply_round(Simd::sub16(b, a), t));
}
/// Blend along x of the two halves of each 32 bits: near (1 - t) + far t. The weights are
/// negative: t - 2^15 and -t fit 16 bits, 2^15 would not.
[[gnu::always_inline]] inline V blend_halves(V pair, V weights) noexcept {
  return Simd::sra32<15>(Simd::sub32(Simd::set32(1 << 14), Simd::multiply_pairs(pair, weights)));
}

/// Cells of some samples: their corners in the volume.
struct PointCells {
  alignas(64) std::uint32_t voxel[kPointLanes];  ///< index of the low corner, 0 outside
  V inside;   ///< all ones inside; not set where all are known to be
  V x, y, z;  ///< how far in: weights of `blend_halves`, then twice 16 bits
};

/// Vectors of samples that take each step together. A sample's steps wait for each other, some 150
/// cycles in all, and no core reorders far enough to begin the next one meanwhile.
struct PointBlock {
  static constexpr std::int32_t kMost = 16;

  std::int32_t count = 0;
  std::int32_t first[kMost];  ///< sample of each vector
  PointCells cell[kMost];
  V corner[kMost][4];
};

/// `kInside`: all are known to be in the volume.
template <bool kInside>
[[gnu::always_inline]] inline PointCells point_cells(const PointPositions<FixedNumbers>& places,
                                                     const std::int32_t (&centre)[3],
                                                     const VoxelGrid& grid,
                                                     std::int32_t first) noexcept {
  V low[3], in[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const V at =
        Simd::add32(Simd::load(places.offset_vox[axis] + first), Simd::set32(centre[axis]));
    low[axis] = Simd::sra32<16>(at);
    in[axis] = Simd::srl32<1>(Simd::bit_and(at, Simd::set32(0xffff)));
  }
  const V row = Simd::add32(low[1], Simd::multiply32(low[2], Simd::set32(grid.ny)));
  V voxel = Simd::add32(low[0], Simd::multiply32(row, Simd::set32(grid.nx)));
  PointCells cells;
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
    voxel = Simd::bit_and(voxel, cells.inside);
  }
  Simd::store(cells.voxel, voxel);
  return cells;
}

/// Densities over 2 at (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1) of each cell.
[[gnu::always_inline]] inline void read_corners(const DensityField& field, const PointCells& cell,
                                                V (&corner)[4]) noexcept {
  const std::ptrdiff_t row = field.grid.nx, plane = row * field.grid.ny;
  const auto read = [&](std::ptrdiff_t offset) {
    return Simd::srl16<1>(Simd::load_pairs(field.density + offset, cell.voxel));
  };
  corner[0] = read(0);
  corner[1] = read(row);
  corner[2] = read(plane);
  corner[3] = read(plane + row);
}

/// The density of contact, not clipped, from both halves of the cell along x.
template <bool kInside>
[[gnu::always_inline]] inline V scaled_density(V at, const PointCells& cell,
                                               const DensityScale& scale) noexcept {
  V read = blend_halves(at, cell.x);
  if constexpr (!kInside) read = Simd::bit_and(read, cell.inside);
  return Simd::srl32(Simd::multiply32(read, Simd::set32(static_cast<int>(scale.mantissa))),
                     scale.shift);
}

/// Adds the gradient of the density between the `corner`s, weighted by `weight`.
[[gnu::always_inline]] inline void add_gradients(const V (&corner)[4], const PointCells& cell, V at,
                                                 V near_z, V far_z, V weight,
                                                 PointVectors& sums) noexcept {
  if (!Simd::any(weight)) return;
  const V near_y = blend16(corner[0], corner[2], cell.z),
          far_y = blend16(corner[1], corner[3], cell.z);
  const V slope[3] = {Simd::multiply_pairs(at, Simd::pair16(-1, 1)),
                      blend_halves(Simd::sub16(far_y, near_y), cell.x),
                      blend_halves(Simd::sub16(far_z, near_z), cell.x)};
  const PointWeights pulls(weight);
  for (std::size_t axis = 0; axis < 3; ++axis) pulls.add(sums.gradient[axis], slope[axis]);
}

/// `point_sample` and `add_sample` of kPointLanes samples.
template <bool kRound, bool kInside>
[[gnu::always_inline]] inline void add_samples(const PointTable<FixedNumbers>& table,
                                               const DensityScale& scale, std::int32_t first,
                                               const PointCells& cell, const V (&corner)[4],
                                               PointVectors& sums) noexcept {
  const V near_z = blend16(corner[0], corner[1], cell.y);
  const V far_z = blend16(corner[2], corner[3], cell.y);
  const V at = blend16(near_z, far_z, cell.z);
  const V scaled = scaled_density<kInside>(at, cell, scale);
  // Only density that is not clipped has a gradient.
  const V open = Simd::sra32<31>(Simd::sub32(scaled, Simd::set32(32768)));
  const V sample = Simd::add32(Simd::count32(), Simd::set32(first));
  if (!Simd::any(open)) {  // deep inside
    sums.top = Simd::max32(sums.top, Simd::bit_or(Simd::set32(32767 << kSampleBits), sample));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sums.full_offset[axis] =
          Simd::add32(sums.full_offset[axis], Simd::load(table.offset[axis] + first));
    }
    sums.full += kPointLanes;
    return;
  }
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
  const PointWeights weights(w);
  weights.count(sums.weight);
  weights.add(sums.density, r);
  weights.add(sums.square, r2);
  V r3 = Simd::zero(), lift = w;
  if constexpr (kRound) {
    r3 = Simd::srl32<6>(Simd::multiply_pairs(Simd::srl32<1>(r2), r));
    lift = Simd::srl32<8>(Simd::multiply32(Simd::srl32<8>(r3), r2));
  }
  const PointWeights lifts(lift);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lifts.add(sums.offset[axis], Simd::load(table.offset[axis] + first));
  }
  if constexpr (!kRound) {
    const PointWeights highs(Simd::srl32<8>(Simd::multiply32(Simd::srl32<8>(w), r2)));
    highs.count(sums.high);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      highs.add(sums.high_offset[axis], Simd::load(table.offset[axis] + first));
    }
  }
  const V marked = Simd::bit_or(Simd::sll32<kSampleBits>(r), Simd::bit_and(sample, strong));
  sums.top = Simd::max32(sums.top, marked);

  V v = w;
  if constexpr (kRound) v = Simd::sub32(Simd::add32(Simd::add32(w, w), w), r3);
  add_gradients(corner, cell, at, near_z, far_z, Simd::bit_and(v, open), sums);
}

template <bool kRound, bool kInside>
[[gnu::always_inline]] inline void add_block(const PointTable<FixedNumbers>& table,
                                             const PointPositions<FixedNumbers>& places,
                                             const std::int32_t (&centre)[3],
                                             const DensityField& field, PointBlock& block,
                                             PointVectors& sums) noexcept {
  for (std::int32_t k = 0; k < block.count; ++k) {
    block.cell[k] = point_cells<kInside>(places, centre, field.grid, block.first[k]);
  }
  for (std::int32_t k = 0; k < block.count; ++k) {
    read_corners(field, block.cell[k], block.corner[k]);
  }
  for (std::int32_t k = 0; k < block.count; ++k) {
    add_samples<kRound, kInside>(table, field.scale, block.first[k], block.cell[k], block.corner[k],
                                 sums);
  }
  block.count = 0;
}

/// Groups from `begin` to `end`, but those in free space.
template <bool kRound, bool kInside>
[[gnu::always_inline]] inline void add_groups(const PointTable<FixedNumbers>& table,
                                              const PointPositions<FixedNumbers>& places,
                                              const std::int32_t (&centre)[3],
                                              const DensityField& field, std::int32_t begin,
                                              std::int32_t end, PointVectors& sums) noexcept {
  OpenGroups open;
  find_open<kInside>(table, places, centre, field.free, begin, end, open);
  sums.read += open.count * kPointGroup;
  PointBlock block;
  for (std::int32_t k = 0; k < open.count; ++k) {
    for (std::int32_t i = 0; i < kPointGroup; i += kPointLanes) {
      block.first[block.count++] = open.group[k] * kPointGroup + i;
    }
    if (block.count == PointBlock::kMost) {
      add_block<kRound, kInside>(table, places, centre, field, block, sums);
    }
  }
  add_block<kRound, kInside>(table, places, centre, field, block, sums);
}

/// Of the 32-bit entries.
inline std::int32_t sum32(V entries) noexcept {
  alignas(64) std::int32_t lane[kPointLanes];
  Simd::store(lane, entries);
  std::int32_t sum = 0;
  for (const std::int32_t entry : lane) sum += entry;
  return sum;
}

/// Of 32-bit entries that are not negative.
inline std::int32_t highest32(V entries) noexcept {
  alignas(64) std::int32_t lane[kPointLanes];
  Simd::store(lane, entries);
  std::int32_t highest = 0;
  for (const std::int32_t entry : lane) highest = entry > highest ? entry : highest;
  return highest;
}

/// `kInside`: the whole tool is. The padding of the last group is not, so that group is read with
/// checks.
template <bool kRound, bool kInside>
[[gnu::always_inline]] inline void sum_points_by(const PointTable<FixedNumbers>& table,
                                                 const PointPositions<FixedNumbers>& places,
                                                 const std::int32_t (&centre)[3],
                                                 const DensityField& field,
                                                 PointSums<FixedNumbers>& out) noexcept {
  PointVectors sums;
  const std::int32_t whole = kInside ? table.count / kPointGroup : 0;
  if constexpr (kInside) {
    add_groups<kRound, true>(table, places, centre, field, 0, whole, sums);
  }
  add_groups<kRound, false>(table, places, centre, field, whole, table.groups, sums);
  constexpr const PointSums<FixedNumbers>& kFull = kFullSample<kRound>;
  out.weight = Simd::sum64(sums.weight) + sums.full * kFull.weight;
  out.density = Simd::sum64(sums.density) + sums.full * kFull.density;
  out.square = Simd::sum64(sums.square) + sums.full * kFull.square;
  out.high = Simd::sum64(sums.high) + sums.full * kFull.high;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.gradient[axis] = Simd::sum64(sums.gradient[axis]);
    const std::int64_t full_offset = sum32(sums.full_offset[axis]);
    out.offset[axis] = Simd::sum64(sums.offset[axis]) + kFull.offset[0] * full_offset;
    out.high_offset[axis] =
        Simd::sum64(sums.high_offset[axis]) + kFull.high_offset[0] * full_offset;
  }
  const std::int32_t highest = highest32(sums.top);
  out.top = highest >> kSampleBits;
  out.top_sample = highest & (kMaxShellPoints - 1);
  out.read = sums.read;
}

void sum_point_samples(const PointTable<FixedNumbers>& table,
                       const PointPositions<FixedNumbers>& places, const std::int32_t (&centre)[3],
                       const DensityField& field, PointSums<FixedNumbers>& sums) noexcept {
  const std::int32_t size[3] = {field.grid.nx, field.grid.ny, field.grid.nz};
  bool has_cells = true, inside = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    has_cells = has_cells && size[axis] > 1;
    inside = inside && centre[axis] >= table.reach &&
             (std::int64_t{centre[axis]} + table.reach) >> 16 < size[axis] - 1;
  }
  if (!has_cells) {  // no voxel that a sample outside could read in its place
    sums = {};
  } else if (table.round) {
    inside ? sum_points_by<true, true>(table, places, centre, field, sums)
           : sum_points_by<true, false>(table, places, centre, field, sums);
  } else {
    inside ? sum_points_by<false, true>(table, places, centre, field, sums)
           : sum_points_by<false, false>(table, places, centre, field, sums);
  }
}

void read_point_samples(const PointPositions<FixedNumbers>& places, std::int32_t count,
                        const std::int32_t (&centre)[3], const DensityField& field,
                        std::int32_t* density) noexcept {
  const VoxelGrid& grid = field.grid;
  const bool has_cells = grid.nx > 1 && grid.ny > 1 && grid.nz > 1;
  for (std::int32_t i = 0; i < count; i += kPointLanes) {
    V scaled = Simd::zero();
    if (has_cells) {
      const PointCells cell = point_cells<false>(places, centre, grid, i);
      V corner[4];
      read_corners(field, cell, corner);
      const V near_z = blend16(corner[0], corner[1], cell.y),
              far_z = blend16(corner[2], corner[3], cell.y);
      scaled = scaled_density<false>(blend16(near_z, far_z, cell.z), cell, field.scale);
    }
    Simd::store(density + i, Simd::min32(scaled, Simd::set32(32767)));
  }
}

/// Sums over close samples, of 64-bit entries.
struct PowerVectors {
  V weight = Simd::zero(), density = Simd::zero();
  V offset[3] = {Simd::zero(), Simd::zero(), Simd::zero()};

  [[gnu::always_inline]] void add(V power, V t, const V (&at)[3]) noexcept {
    const PointWeights weights(power);
    weights.count(weight);
    weights.add(density, t);
    for (std::size_t axis = 0; axis < 3; ++axis) weights.add(offset[axis], at[axis]);
  }
  [[nodiscard]] PowerSums<FixedNumbers> sums() const noexcept {
    return {Simd::sum64(weight),
            Simd::sum64(density),
            {Simd::sum64(offset[0]), Simd::sum64(offset[1]), Simd::sum64(offset[2])}};
  }
};

/// Of 64-bit entries.
struct NormalVectors {
  V weight = Simd::zero();
  V normal[3] = {Simd::zero(), Simd::zero(), Simd::zero()};

  [[gnu::always_inline]] void add(V power, const V (&at)[3]) noexcept {
    const PointWeights weights(power);
    weights.count(weight);
    for (std::size_t axis = 0; axis < 3; ++axis) weights.add(normal[axis], at[axis]);
  }
  [[nodiscard]] NormalSums<FixedNumbers> sums() const noexcept {
    return {Simd::sum64(weight),
            {Simd::sum64(normal[0]), Simd::sum64(normal[1]), Simd::sum64(normal[2])}};
  }
};

void sum_close_samples(const CloseSampleView<FixedNumbers>& look,
                       CloseSums<FixedNumbers>& sums) noexcept {
  sums = {};
  V top = Simd::zero();
  const auto product = [](V a, V b) {
    return Simd::srl32<15>(Simd::add32(Simd::multiply32(a, b), Simd::set32(1 << 14)));
  };
  const auto over = Simd::set32(over_radius(look)), least = Simd::set32(-look.radius),
             most = Simd::set32(look.radius), one = Simd::set32(1 << 15);
  for (std::int32_t i = 0; i < look.count; i += kPointLanes) {
    V rest = one;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const V from = Simd::sub32(Simd::load(look.offset[axis] + i), Simd::set32(look.middle[axis]));
      const V along = Simd::min32(Simd::max32(from, least), most);
      const V share = Simd::sra32<15>(Simd::multiply32(along, over));
      rest = Simd::sub32(rest, product(share, share));
    }
    rest = Simd::max32(rest, Simd::zero());
    const V window = product(rest, rest);
    Simd::store(look.window + i, window);
    // A sample that does not count has density 0 here.
    const V counts = Simd::min32(Simd::multiply32(window, one), Simd::load(look.density + i));
    top = Simd::max32(top, counts);
  }
  sums.top = highest32(top);
  if (sums.top < kFaintest<FixedNumbers>) return;
  const auto over_top =
      Simd::set32(static_cast<std::int32_t>((1U << 31) / static_cast<std::uint32_t>(sums.top)));
  const auto square = [product](V t) { return product(t, t); };
  const auto load = [](const std::int32_t* const(&of)[3], std::int32_t i, V(&to)[3]) {
    for (std::size_t axis = 0; axis < 3; ++axis) to[axis] = Simd::load(of[axis] + i);
  };
  NormalVectors facing;
  PowerVectors low, high;
  for (std::int32_t i = 0; i < look.count; i += kPointLanes) {
    const V t = Simd::srl32<16>(Simd::multiply32(Simd::load(look.density + i), over_top));
    const V window = Simd::load(look.window + i);
    V power = t, normal[3], offset[3];
    load(look.normal, i, normal);
    load(look.offset, i, offset);
    for (int p = 1; p < CloseSums<FixedNumbers>::kNormalPower; p *= 2) power = square(power);
    facing.add(product(power, window), normal);
    power = square(power);
    low.add(product(power, window), t, offset);
    high.add(product(square(power), window), t, offset);
  }
  sums.facing = facing.sums();
  sums.low = low.sums();
  sums.high = high.sums();
}

}  // namespace
}  // namespace kerf
