// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/exact_taps.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Voxels of the box around a tool beyond the tool: two of gradient at each end, one of the cell.
inline constexpr std::int32_t kBoxMargin = 5;

/// Entries before each row of overlap ratios: zeros that the x filter may read.
inline constexpr std::int32_t kRatioRowPad = 8;

/// The box of voxels that one tick copies out of the volume and works on: the cells of the tool's
/// samples, and what their gradients reach.
struct TickBox {
  VoxelIndex size;  ///< low corners of cells along each axis: voxels of an unturned tool
  VoxelIndex box;   ///< size + kBoxMargin: pitch and plane of the copy, one stream
  ExactTaps taps{};
  std::int32_t row_lanes = 0;  ///< box.x rounded up to 32: entries in a row of ratios
  int sum_shift = 0;           ///< of sums of exact gradients: exact_taps.hpp
};

/// Voxels of a plane of cells, at most: the sum over it of exact gradients, each times a weight of
/// at most 2^15, stays below 2^63.
inline constexpr std::int32_t kMaxPlaneVoxels = 36'000;
static_assert(kMaxPlaneVoxels <= (std::uint64_t{1} << 63) / 32768 / kMaxExactGradient);

[[nodiscard]] constexpr TickBox tick_box(VoxelIndex size, const ExactTaps& taps,
                                         std::size_t samples) noexcept {
  const VoxelIndex box{size.x + kBoxMargin, size.y + kBoxMargin, size.z + kBoxMargin};
  return {size, box, taps, (box.x + 31) / 32 * 32, sum_shift(samples)};
}

/// Working memory of one tick, shared by all tools and volumes; any contents. Ratios, filter and
/// live rows may be missing where nothing is milled.
struct BoxScratch {
  std::int16_t* box = nullptr;     ///< density - 32768 around the tool, as one stream
  std::int16_t* ratio = nullptr;   ///< minus the overlap ratio (2^15 = 1), rows of row_lanes + pad
  std::int32_t* filter = nullptr;  ///< two planes of box.y rows, filtered along z
  std::int16_t* inside = nullptr;  ///< -1 for entries of a box row inside the volume, else 0
  std::uint8_t* live = nullptr;    ///< rows that have an overlap
};

/// Entries of each array of BoxScratch that a tool needs.
struct BoxScratchSize {
  std::size_t box, ratio, filter, inside, live;
};

[[nodiscard]] constexpr BoxScratchSize box_scratch_size(VoxelIndex tool_size) noexcept {
  const auto edge = [](std::int32_t n) { return static_cast<std::size_t>(n) + kBoxMargin; };
  constexpr std::size_t kWidestVector = 32;
  const std::size_t row = (edge(tool_size.x) + 31) / 32 * 32;
  const std::size_t rows =
      (static_cast<std::size_t>(tool_size.y) + 1) * (static_cast<std::size_t>(tool_size.z) + 1);
  // Rows are read and written as whole vectors, so each array ends with room for one more.
  return {.box = edge(tool_size.x) * edge(tool_size.y) * edge(tool_size.z) + row + kWidestVector,
          .ratio = kRatioRowPad + rows * (row + kRatioRowPad) + kWidestVector,
          .filter = 2 * edge(tool_size.y) * row,
          .inside = row,
          .live = rows};
}

}  // namespace kerf
