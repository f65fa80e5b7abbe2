// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/sampling.hpp"

// Gradients and the methods `aligned` and `splat` by their definitions, without tables: every fast
// path has these bits.

namespace kerf {

/// The gradient of one voxel as the plain sum over 5x5x5 densities: density outside
/// the volume is 0. Slow; `refresh_gradients` gives the same bits.
template <class N>
[[nodiscard]] constexpr Gradient<N> gradient_dense(GradientKernel kernel, const VoxelGrid& grid,
                                                   std::span<const Density> density,
                                                   VoxelIndex at) noexcept {
  const GradientTaps tap = taps(kernel);
  std::int64_t x = 0, y = 0, z = 0;
  for (std::int32_t k = 0; k < 5; ++k) {
    for (std::int32_t j = 0; j < 5; ++j) {
      for (std::int32_t i = 0; i < 5; ++i) {
        const VoxelIndex v{at.x + i - kGradientReach, at.y + j - kGradientReach,
                           at.z + k - kGradientReach};
        if (!grid.contains(v)) continue;
        const auto a = static_cast<std::size_t>(i);
        const auto b = static_cast<std::size_t>(j);
        const auto c = static_cast<std::size_t>(k);
        const std::int64_t rho = density[grid.index(v.x, v.y, v.z)];
        x += rho * tap.slope[a] * tap.smooth[b] * tap.smooth[c];
        y += rho * tap.smooth[a] * tap.slope[b] * tap.smooth[c];
        z += rho * tap.smooth[a] * tap.smooth[b] * tap.slope[c];
      }
    }
  }
  return {gradient_from_sum<N>(x, tap.shift), gradient_from_sum<N>(y, tap.shift),
          gradient_from_sum<N>(z, tap.shift)};
}

// The definition of the method `aligned` (docs/forces.md 7.6), without tables: every fast path has
// these bits. Overlap and removal are those of overlap.hpp and milling.hpp. Fixed point only.

/// The exact tap sum of a voxel, inside or outside the volume (density outside is 0): its gradient
/// times 2^shift / factor. At most kMaxExactGradient.
[[nodiscard]] constexpr SumVec<FixedNumbers> gradient_exact(const ExactTaps& taps,
                                                            const VoxelGrid& grid,
                                                            std::span<const Density> density,
                                                            VoxelIndex at) noexcept {
  SumVec<FixedNumbers> sum{};
  for (std::int32_t k = 0; k < 5; ++k) {
    for (std::int32_t j = 0; j < 5; ++j) {
      for (std::int32_t i = 0; i < 5; ++i) {
        const VoxelIndex v{at.x + i - kGradientReach, at.y + j - kGradientReach,
                           at.z + k - kGradientReach};
        if (!grid.contains(v)) continue;
        const auto a = static_cast<std::size_t>(i);
        const auto b = static_cast<std::size_t>(j);
        const auto c = static_cast<std::size_t>(k);
        const std::int64_t rho = density[grid.index(v.x, v.y, v.z)];
        sum.x += rho * taps.slope[a] * taps.smooth[b] * taps.smooth[c];
        sum.y += rho * taps.smooth[a] * taps.slope[b] * taps.smooth[c];
        sum.z += rho * taps.smooth[a] * taps.smooth[b] * taps.slope[c];
      }
    }
  }
  return sum;
}

/// SUM over samples of the interpolated gradient, in density steps per voxel times 2^8.
///
/// For each corner of the common cell the exact gradients of all samples are added up; 8 bits are
/// kept of that sum (one rounding, half up), and three lerps blend the corners. `gradient_at` is
/// `gradient_exact` or a cache of it.
template <class GradientAt>
[[nodiscard]] constexpr SumVec<FixedNumbers> aligned_contact_sum(
    const ExactTaps& taps, GradientAt&& gradient_at, std::span<const ToolOffset> offsets,
    const ToolPose<FixedNumbers>& pose) noexcept {
  using Corners = std::array<std::int64_t, 8>;
  if (offsets.empty()) return {};
  Corners x{}, y{}, z{};
  for (const ToolOffset& offset : offsets) {
    const VoxelIndex low = cell_at<FixedNumbers>(sample_position(pose, offset)).low;
    for (std::size_t c = 0; c < 8; ++c) {
      const auto bit = [&](std::size_t axis) { return static_cast<std::int32_t>(c >> axis & 1); };
      const SumVec<FixedNumbers> g =
          gradient_at(VoxelIndex{low.x + bit(0), low.y + bit(1), low.z + bit(2)});
      x[c] += g.x;
      y[c] += g.y;
      z[c] += g.z;
    }
  }
  const auto weight = cell_at<FixedNumbers>(sample_position(pose, offsets.front())).weight;
  const auto blended = [&](Corners& corners) {
    for (std::int64_t& sum : corners) sum = kept_bits(taps, sum);
    return trilinear<FixedNumbers, std::int64_t>(corners, weight);
  };
  return {blended(x), blended(y), blended(z)};
}

/// Three sums of many exact gradients, each over 2^shift.
struct WideSumVec {
  WideSum x, y, z;

  constexpr void add(const SumVec<FixedNumbers>& term, int shift) noexcept {
    x.add(term.x, shift);
    y.add(term.y, shift);
    z.add(term.z, shift);
  }
  [[nodiscard]] constexpr SumVec<FixedNumbers> over(int shift) const noexcept {
    return {x.over(shift), y.over(shift), z.over(shift)};
  }
};

/// SUM over voxels j with c_j > 0 and density > 0 of c_j times the exact gradient, in density steps
/// per voxel times 2^(15 - sum_shift) * 2^shift / factor; `samples` are those of the tool. The
/// density is that from before the removal.
template <class GradientAt>
[[nodiscard]] constexpr SumVec<FixedNumbers> exact_modification_sum(
    GradientAt&& gradient_at, const VoxelGrid& grid, std::span<const Density> density,
    const OverlapBox<FixedNumbers>& overlap, std::size_t samples) noexcept {
  const int shift = sum_shift(samples);
  WideSumVec sum;
  const VoxelBox box = overlap.box.clipped(grid.box());
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) {
        const std::int64_t ratio = overlap.memory[overlap.at({x, y, z})];
        if (ratio == 0 || density[grid.index(x, y, z)] == 0) continue;
        sum.add(ratio * gradient_at(VoxelIndex{x, y, z}), shift);
      }
    }
  }
  return sum.over(shift);
}

// The method `splat` by its definition. Its modification sum is `exact_modification_sum`, overlap
// and removal are those of overlap.hpp and milling.hpp. Fixed point only.

/// SUM over samples i of SUM over the corners c of its cell of w_ic times the exact gradient, in
/// density steps per voxel times 2^(15 - sum_shift) * 2^shift / factor. Nothing is rounded but the
/// weights, and the sum once.
/// Density outside the volume is 0; `gradient_at` is `gradient_exact` or a cache of it.
template <class GradientAt>
[[nodiscard]] constexpr SumVec<FixedNumbers> splat_contact_sum(
    GradientAt&& gradient_at, std::span<const ToolOffset> offsets,
    const ToolPose<FixedNumbers>& pose) noexcept {
  const int shift = sum_shift(offsets.size());
  WideSumVec sum;
  for (const ToolOffset& offset : offsets) {
    const auto cell = cell_at<FixedNumbers>(sample_position(pose, offset));
    const auto weights = trilinear_weights<FixedNumbers>(cell.weight);
    for (std::size_t c = 0; c < 8; ++c) {
      const auto bit = [&](std::size_t axis) { return static_cast<std::int32_t>(c >> axis & 1); };
      sum.add(std::int64_t{weights[c]} *
                  gradient_at(
                      VoxelIndex{cell.low.x + bit(0), cell.low.y + bit(1), cell.low.z + bit(2)}),
              shift);
    }
  }
  return sum.over(shift);
}

}  // namespace kerf
