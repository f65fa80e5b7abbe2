// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/volume/voxel_grid.hpp"

// Milling by overlap: rate of removal, modification force, removal.

namespace kerf {

/// 1 - exp(-x) for x >= 0 by its series; full double precision below 1/4. For load time: from + - *
/// / alone, so that the last bit does not depend on a libm.
[[nodiscard]] constexpr double decay_small(double x) noexcept {
  double term = x, sum = 0;
  for (int n = 2; n < 16; ++n) {
    sum += term;
    term *= -x / n;
  }
  return sum;
}

/// 1 - exp(-x) for any x >= 0, within 1e-13.
[[nodiscard]] constexpr double decay(double x) noexcept {
  constexpr int kHalvings = 8;
  constexpr double kWhole = 42.0;  // exp(-x) is below 1e-18
  if (!(x < kWhole)) return 1.0;
  double part = decay_small(x / (1 << kHalvings));
  for (int i = 0; i < kHalvings; ++i) part = part * (2 - part);
  return part;
}

/// The part of a voxel with overlap c that one tick removes (docs/forces.md 7.5): the fraction c *
/// min(1, kT), or 1 - exp(-c kT) in the exact form, whose result after a given time does not depend
/// on the rate.
///
/// Fixed: the fraction at c = 1 is `mantissa` 2^-(15 + exponent). The exact form bends c by a table
/// of f(c) / f(1) with linear steps between 257 entries: within (kT)^2 / (8 * 256^2) / f(1) and two
/// weight steps, never falling. Made at load time by `removal_rate`.
template <class N>
struct RemovalRate {
  static constexpr std::size_t kSteps = 256;

  typename N::Weight mantissa{};  ///< fixed: 16384..32768, or 0 for nothing; floating: the fraction
  int exponent = 0;               ///< fixed: 0..32; floating: 0
  bool bent = false;
  std::array<typename N::Weight, kSteps + 1> bend{};
};

namespace detail {

/// A weight from 0..1, rounded.
template <class N>
[[nodiscard]] constexpr typename N::Weight weight_from(double fraction) noexcept {
  if constexpr (N::kIsFixed) {
    return static_cast<typename N::Weight>(fraction * N::kWeightOne + 0.5);
  } else {
    return static_cast<typename N::Weight>(fraction);
  }
}

}  // namespace detail

/// Above this exp(-kT) is below 1e-13 of a density step: a larger rate changes nothing.
inline constexpr double kMaxRateTimesTick = 42.0;

/// `k_times_t` is rate times tick; up to 2^-33, negative or NaN removes nothing. Load time.
template <class N>
[[nodiscard]] constexpr RemovalRate<N> removal_rate(double k_times_t,
                                                    bool exact_exponential) noexcept {
  using Rate = RemovalRate<N>;
  Rate rate;
  if (!(k_times_t > 0)) return rate;
  double fraction = k_times_t < 1 ? k_times_t : 1;
  if (exact_exponential) {
    const double kt = k_times_t < kMaxRateTimesTick ? k_times_t : kMaxRateTimesTick;
    const double step = decay_small(kt / double(Rate::kSteps));
    std::array<double, Rate::kSteps + 1> decay{};
    for (std::size_t i = 0; i < Rate::kSteps; ++i) decay[i + 1] = decay[i] + (1 - decay[i]) * step;
    fraction = decay[Rate::kSteps];
    rate.bent = true;
    for (std::size_t i = 0; i <= Rate::kSteps; ++i) {
      rate.bend[i] = detail::weight_from<N>(decay[i] / fraction);
    }
  }
  if constexpr (N::kIsFixed) {
    while (fraction <= 0.5 && rate.exponent < 32) {
      fraction *= 2;
      ++rate.exponent;
    }
    rate.mantissa = fraction > 0.5 ? detail::weight_from<N>(fraction) : 0;
  } else {
    rate.mantissa = detail::weight_from<N>(fraction);
  }
  return rate;
}

/// The overlap ratio after the bend of the exact form; 0 stays 0 and kWeightOne stays itself.
template <class N>
[[nodiscard]] constexpr typename N::Weight bent_ratio(const RemovalRate<N>& rate,
                                                      typename N::Weight ratio) noexcept {
  using Weight = typename N::Weight;
  if (!rate.bent) return ratio;
  if constexpr (N::kIsFixed) {
    const auto i = static_cast<std::size_t>(ratio >> 7);  // 2^15 in 256 steps of 2^7
    if (i >= rate.kSteps) return rate.bend[rate.kSteps];
    const Weight rise = rate.bend[i + 1] - rate.bend[i];
    return rate.bend[i] + ((rise * (ratio & 127) + 64) >> 7);
  } else {
    const Weight place = ratio * Weight(rate.kSteps);
    const auto i = static_cast<std::size_t>(place);
    if (i >= rate.kSteps) return rate.bend[rate.kSteps];
    return rate.bend[i] + (rate.bend[i + 1] - rate.bend[i]) * (place - Weight(i));
  }
}

// One tick of cutting, in this order: `overlap`, `modification_sum`, `remove`, `refresh_gradients`.
// Force comes first: `modification_sum` sees the density and the gradients from before the removal.

/// SUM over voxels j with c_j > 0 and density > 0 of c_j grad_j, the stored gradient: in density
/// steps per voxel times kWeightOne. The modification force is minus this, scaled by p1 V_voxel
/// (docs/forces.md 7.4).
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

/// Fractions of a density step that were not removed yet, one per lane (x from the tool's lowest
/// cell on). Without them slow cutting would round to zero. Fixed: 16 fraction bits.
template <class N>
using RemovalCarry = std::conditional_t<N::kIsFixed, std::uint16_t, typename N::Sum>;

/// Lanes that `remove` needs for a tool whose overlap box is at most `width` voxels wide.
[[nodiscard]] constexpr std::size_t removal_lanes(std::size_t overlap_width) noexcept {
  return overlap_width + 4;
}

/// The result of one call of `remove`.
struct Removed {
  std::uint64_t density_steps = 0;  ///< SUM of the decrease: times V_voxel / 65535 is a volume
  VoxelBox changed;                 ///< tightest box around the voxels that lost density
};

namespace detail {

/// Density steps that leave a voxel, never more than `rho`; fractions of a step go to `owed`.
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

/// rho_j -= rho_j f(c_j) for every voxel of the overlap, f the fraction of `rate`. Whole steps are
/// removed from the volume; the rest is added to `carry`, for the next voxel of the lane. Rows in
/// z, y, x order.
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

namespace detail {

/// The exact form of the removal rate, entry by entry: it is a table look-up.
inline void bend_ratios(const TickBox& box, const BoxScratch& scratch,
                        const RemovalRate<FixedNumbers>& rate) noexcept {
  std::int16_t* ratio = scratch.ratio + kRatioRowPad;
  const std::int32_t rows = (box.size.y + 1) * (box.size.z + 1);
  for (std::int32_t row = 0; row < rows; ++row, ratio += box.row_lanes + kRatioRowPad) {
    if (scratch.live[row] == 0) continue;
    for (std::int32_t x = 2; x <= box.size.x + 2; ++x) {
      ratio[x] = static_cast<std::int16_t>(-bent_ratio(rate, std::int32_t{-ratio[x]}));
    }
  }
}

}  // namespace detail

/// Removes density from the volume by the ratios in the scratch: `remove`. `carry` has at least
/// row_lanes entries.
[[nodiscard]] inline Removed cut_box(const KernelSet& kernels, const TickBox& box,
                                     const BoxScratch& scratch, const VoxelGrid& grid,
                                     std::span<Density> density, VoxelIndex origin,
                                     const RemovalRate<FixedNumbers>& rate,
                                     std::span<std::uint16_t> carry) noexcept {
  Removed removed;
  if (rate.mantissa == 0) return removed;
  if (rate.bent) detail::bend_ratios(box, scratch, rate);
  const BoxCut cut = kernels.cut(box, {static_cast<std::uint16_t>(rate.mantissa), rate.exponent},
                                 grid, density.data(), origin, scratch, carry.data());
  removed.density_steps = cut.density_steps;
  if (cut.density_steps != 0) {
    removed.changed = {{origin.x + cut.lo.x, origin.y + cut.lo.y, origin.z + cut.lo.z},
                       {origin.x + cut.hi.x + 1, origin.y + cut.hi.y + 1, origin.z + cut.hi.z + 1}};
  }
  return removed;
}

}  // namespace kerf
