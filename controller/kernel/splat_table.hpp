// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/sample_table.hpp"
#include "controller/kernel/tick_box.hpp"

namespace kerf {

// The method `splat`: any pose of any shape, in scenes that cut. Each sample adds its eight weights
// to the voxels of its cell; the sums PHI_j are all that the forces and the removal need of the
// tool. Contact is SUM_j PHI_j grad rho_j, since the sum of interpolated gradients may be added up
// voxel by voxel. Nothing but the density is stored, nothing is refreshed after a cut.

/// Samples per voxel that a sum can hold: 2^24 of weights of 2^15, so that 5 taps of it fit 32
/// bits.
inline constexpr double kMaxSplatDensity = 512.0;

/// Working memory of one tick of the method `splat`; any contents.
struct SplatScratch {
  BoxScratch tick;               ///< box, ratios, filter and live rows
  std::int32_t* place[3] = {};   ///< of each sample, Q15.16 voxels
  std::int32_t* sums = nullptr;  ///< rows of row_lanes entries: PHI_j, weights of 2^15
  std::int16_t* rest[2] = {};    ///< one plane: minus the sums beyond the ratios, low 15 bits, high
  std::uint8_t* rest_live = nullptr;  ///< by row of the plane: which of the two are not all 0
};

/// Lanes of the removal carry for a tool that touches at most `width_vox` voxels along x: the
/// widest row of its box.
[[nodiscard]] constexpr std::size_t splat_lanes(std::size_t width_vox) noexcept {
  return (width_vox - 1 + kBoxMargin + 31) / 32 * 32;
}

/// Entries of the arrays of SplatScratch, beside those of BoxScratch.
struct SplatScratchSize {
  std::size_t place, sums, rest, rest_live;
};

[[nodiscard]] constexpr SplatScratchSize splat_scratch_size(VoxelIndex size,
                                                            std::size_t samples) noexcept {
  const auto row = static_cast<std::size_t>(tick_box(size, kExactFarid, samples).row_lanes);
  const auto rows = static_cast<std::size_t>(size.y) + 1;
  constexpr auto kGroup = static_cast<std::size_t>(kSampleGroup);
  return {.place = (samples + kGroup - 1) / kGroup * kGroup,
          .sums = row * rows * (static_cast<std::size_t>(size.z) + 1),
          .rest = kRatioRowPad + rows * (row + kRatioRowPad),
          .rest_live = rows};
}

}  // namespace kerf
