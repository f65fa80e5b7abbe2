// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"

namespace kerf {

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

/// Takes from the volume what the ratios in the scratch say: `remove`. `carry` has at least
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
