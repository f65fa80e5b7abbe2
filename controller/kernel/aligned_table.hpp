// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/tick_box.hpp"

namespace kerf {

// The plan `aligned`: the tool's voxels lie on a lattice as fine as the volume's and are not
// turned, so all samples share one place within their cells. The sum of interpolated gradients is
// then a correlation of the density with a fixed table, S' = tool mask convolved with the gradient
// taps, at the eight corners of one cell. Nothing but the density is stored, nothing is refreshed.

inline constexpr AlignedTaps kAlignedFarid{{5, 32, 55, 32, 5}, {-2, -5, 0, 5, 2}, 7, 21};
inline constexpr AlignedTaps kAlignedSobel5{{1, 4, 6, 4, 1}, {-1, -2, 0, 2, 1}, 1, 11};

/// The central difference, scaled as sobel5.
inline constexpr AlignedTaps kAlignedCentral{{0, 0, 32, 0, 0}, {0, -1, 0, 1, 0}, 1, 11};

/// Fraction bits that contact sums keep.
inline constexpr int kAlignedKeptBits = 8;

/// Voxels of a tool along one axis, at most.
inline constexpr std::int32_t kMaxAlignedEdge = 64;
/// The exact gradient of a voxel, times 2^21 / 7, is at most this for farid, less for sobel5: half
/// the slope taps' sum times the smooth taps' squared, times full density.
inline constexpr std::int64_t kMaxExactGradient = std::int64_t{7} * 129 * 129 * 65535;
static_assert(kNarrowSumSamples <= (std::uint64_t{1} << 62) / 32768 / kMaxExactGradient);
static_assert(kMaxPlaneVoxels <= (std::uint64_t{1} << 63) / 32768 / kMaxExactGradient);

/// A run of table entries that meets the box at `box_at` and the seven other corners' offsets.
struct AlignedChunk {
  std::int32_t box_at;  ///< entry of the box, as one stream
  std::int32_t vector;  ///< entry of `AlignedTable::vectors` where its run begins
};

/// What the aligned plan holds of one tool, for kernels of one vector width. Made at load time
/// (controller/scene/aligned_tool.hpp), constant afterwards; points into the maker's memory.
///
/// A table entry has up to 18 bits and is kept as 512 hi + lo, both in 16 bits. A run is `lanes`
/// entries lo, then `lanes` entries hi; with `fused` axes x, y, z follow each other in one run.
struct AlignedTable : TickBox {
  std::array<std::int16_t, 3> low{};  ///< lowest offset of a sample, half pitches
  std::int32_t lanes = 0;             ///< 16-bit entries in a vector
  std::int32_t flush = 0;             ///< chunks that 32-bit sums can take: at most 2^31 - 1
  bool fused = false;                 ///< one list serves the three axes; it is the first
  const AlignedChunk* chunks[3] = {};
  std::int32_t chunk_count[3] = {};
  const std::int16_t* vectors = nullptr;
  /// Tool voxels as bits, rows of row_lanes / 32 words: rows y = -1 .. size.y of planes
  /// z = -1 .. size.z, each row twice: moved by two lanes (cell corner x = 0) and by three.
  const std::uint32_t* mask = nullptr;
};

/// Working memory of one tick, shared by all tools and volumes; any contents. Ratios, filter and
/// live rows may be missing where nothing is milled.
struct AlignedScratch {
  std::int16_t* box = nullptr;     ///< density - 32768 around the tool, as one stream
  std::int16_t* ratio = nullptr;   ///< minus the overlap ratio (2^15 = 1), rows of row_lanes + pad
  std::int32_t* filter = nullptr;  ///< two planes of box.y rows, filtered along z
  std::int16_t* inside = nullptr;  ///< -1 for entries of a box row inside the volume, else 0
  std::uint8_t* live = nullptr;    ///< rows that have an overlap
};

/// Entries of each array of AlignedScratch that a tool needs.
struct AlignedScratchSize {
  std::size_t box, ratio, filter, inside, live;
};

[[nodiscard]] constexpr AlignedScratchSize aligned_scratch_size(VoxelIndex tool_size) noexcept {
  const auto edge = [](std::int32_t n) { return static_cast<std::size_t>(n) + kAlignedBoxMargin; };
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
