// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/removal_rate.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

// One tick of cutting, in this order: `overlap`, `modification_sum`, `remove`, `refresh_gradients`.
// Force comes first: `modification_sum` sees the density and the gradients from before the removal.

/// SUM over voxels j with c_j > 0 and density > 0 of c_j grad_j, the stored gradient: in density
/// steps per voxel times kWeightOne. The modification force is minus this, scaled by p1 V_voxel
/// (docs/theory.md 7.4).
///
/// Fixed: exact, 2^30 per voxel leaves room for 2^33 voxels. Floating: x, then y, then z.
template <class N>
[[nodiscard]] constexpr SumVec<N> modification_sum(const VoxelGrid& grid,
                                                   std::span<const Gradient<N>> field,
                                                   std::span<const Density> density,
                                                   const OverlapBox<N>& overlap) noexcept {
  using Sum = typename N::Sum;
  SumVec<N> sum{};
  const VoxelBox box = overlap.box.clipped(grid.box());
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
        const auto ratio = static_cast<Sum>(overlap.memory[overlap.at({x, y, z})]);
        const std::size_t at = grid.index(x, y, z);
        if (!(ratio > 0) || density[at] == 0) continue;
        sum.x += ratio * static_cast<Sum>(field[at].x);
        sum.y += ratio * static_cast<Sum>(field[at].y);
        sum.z += ratio * static_cast<Sum>(field[at].z);
      }
    }
  }
  return sum;
}

/// Fractions of a density step that removal still owes, one per lane (x from the tool's lowest cell
/// on): slow cutting would otherwise round to nothing. Fixed: 16 fraction bits.
template <class N>
using RemovalCarry = std::conditional_t<N::kIsFixed, std::uint16_t, typename N::Sum>;

/// Lanes that `remove` needs for a tool whose overlap box is at most `width` voxels wide.
[[nodiscard]] constexpr std::size_t removal_lanes(std::size_t overlap_width) noexcept {
  return overlap_width + 4;
}

/// What one call of `remove` took away.
struct Removed {
  std::uint64_t density_steps = 0;  ///< SUM of the decrease: times V_voxel / 65535 is a volume
  VoxelBox changed;                 ///< tightest box around the voxels that lost density
};

namespace detail {

/// Density steps that leave a voxel; `owed` takes what is less than a step. Never more than `rho`.
template <class N>
[[nodiscard]] constexpr Density take(Density rho, typename N::Weight ratio,
                                     const RemovalRate<N>& rate, RemovalCarry<N>& owed) noexcept {
  if constexpr (N::kIsFixed) {
    const std::uint32_t w = static_cast<std::uint32_t>(ratio * rate.mantissa) >> 15;
    const std::uint32_t product = rho * w;  // 15 fraction bits, then 2^-exponent
    const std::uint32_t loss = rate.exponent == 0 ? product << 1 : product >> (rate.exponent - 1);
    const std::uint32_t total = loss + owed;
    owed = static_cast<std::uint16_t>(total & 0xffff);
    return static_cast<Density>(total >> 16);
  } else {
    using Sum = typename N::Sum;
    const Sum total = Sum(rho) * (ratio * rate.mantissa) + owed;
    const auto whole = static_cast<std::uint32_t>(total);  // total < 65537
    const auto decrease = static_cast<Density>(std::min<std::uint32_t>(whole, rho));
    owed = total - Sum(decrease);
    return decrease;
  }
}

}  // namespace detail

/// rho_j -= rho_j f(c_j) for every voxel of the overlap, f the fraction of `rate`; whole steps
/// leave the volume, the rest waits in `carry` and joins the next voxel of the lane. Rows in z, y,
/// x order.
///
/// Fixed: f = c m >> 15, then rho f 2^-exponent with 16 fraction bits, cut off below; at most
/// 0xffff0000 + 0xffff, so 32 unsigned bits hold it and the decrease never exceeds the density.
/// kT = 1 and c = 1 remove everything. `carry` belongs to the tool's state, zero at first, at least
/// `removal_lanes(width of the box)` long; with fewer lanes nothing is removed.
template <class N>
constexpr Removed remove(const VoxelGrid& grid, std::span<Density> density,
                         const OverlapBox<N>& overlap, const RemovalRate<N>& rate,
                         std::span<RemovalCarry<N>> carry) noexcept {
  Removed removed;
  const VoxelBox box = overlap.box.clipped(grid.box());
  if (box.empty() || static_cast<std::int64_t>(carry.size()) < box.hi.x - overlap.lane_zero_vox) {
    return removed;
  }
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
        const auto ratio = bent_ratio(rate, overlap.memory[overlap.at({x, y, z})]);
        Density& rho = density[grid.index(x, y, z)];
        auto& owed = carry[static_cast<std::size_t>(x - overlap.lane_zero_vox)];
        const Density decrease = detail::take<N>(rho, ratio, rate, owed);
        if (decrease == 0) continue;
        rho = static_cast<Density>(rho - decrease);
        removed.density_steps += decrease;
        removed.changed = removed.changed.united({{x, y, z}, {x + 1, y + 1, z + 1}});
      }
    }
  }
  return removed;
}

}  // namespace kerf
