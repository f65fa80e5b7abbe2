// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/tick_box.hpp"

namespace kerf {

/// A tool's samples for kernels of any vector width: offsets in half pitches, axis by axis. Made at
/// load (controller/plan/tables/sample_tool.hpp); points into the maker's memory. Each array goes
/// on to a whole number of `kSampleGroup` with copies of a sample, which no kernel may count.
struct SampleTable {
  const std::int32_t* offset[3] = {};
  std::int32_t count = 0;
};

inline constexpr std::int32_t kSampleGroup = 16;

/// `ToolPose<FixedNumbers>` in plain integers: centre Q15.16 voxels, step Q11.20.
struct SamplePose {
  std::int32_t centre[3];
  std::int32_t step[3][3];
};

/// No sample may be farther from the centre than this in any orientation: step times offset then
/// stays within 2^31, and 32-bit arithmetic gives the place that `sample_position` gives.
inline constexpr std::int32_t kSampleReachVox = 1000;

// The method `splat` (docs/theory.md 7.6): any pose of any shape, in scenes that cut. The sums
// PHI_j of the samples' weights are all that the forces and the removal need of the tool. Nothing
// but the density is stored, nothing is refreshed after a cut.

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
