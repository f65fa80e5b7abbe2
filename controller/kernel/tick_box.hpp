// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/wide_sum.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Gradient taps whose slopes have no common factor: it is applied once, to the finished sum, which
/// is then divided by 2^shift. Exact sums are before both.
struct AlignedTaps {
  std::int32_t smooth[5];
  std::int32_t slope[5];
  std::int32_t factor;
  std::int32_t shift;
};

/// Voxels of the box around a tool beyond the tool: two of gradient at each end, one of the cell.
inline constexpr std::int32_t kAlignedBoxMargin = 5;

/// Entries before each row of overlap ratios: zeros that the x filter may read.
inline constexpr std::int32_t kRatioRowPad = 8;

/// The box of voxels that one tick copies out of the volume and works on: the cells of the tool's
/// samples, and what their gradients reach.
struct TickBox {
  VoxelIndex size;  ///< low corners of cells along each axis: voxels of an unturned tool
  VoxelIndex box;   ///< size + kAlignedBoxMargin: pitch and plane of the copy, one stream
  AlignedTaps taps{};
  std::int32_t row_lanes = 0;  ///< box.x rounded up to 32: entries in a row of ratios
  int sum_shift = 0;           ///< of sums of exact gradients: wide_sum.hpp
};

/// Voxels of a plane of cells, at most: the sum over it of exact gradients, each times a weight of
/// at most 2^15, stays below 2^63.
inline constexpr std::int32_t kMaxPlaneVoxels = 36'000;

[[nodiscard]] constexpr TickBox tick_box(VoxelIndex size, const AlignedTaps& taps,
                                         std::size_t samples) noexcept {
  const VoxelIndex box{size.x + kAlignedBoxMargin, size.y + kAlignedBoxMargin,
                       size.z + kAlignedBoxMargin};
  return {size, box, taps, (box.x + 31) / 32 * 32, sum_shift(samples)};
}

}  // namespace kerf
