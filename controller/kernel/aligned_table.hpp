// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "controller/kernel/tick_box.hpp"
#include "shared/numeric/fixed.hpp"

namespace kerf {

// The method `aligned` (docs/theory.md 7.6): the tool's voxels lie on a lattice as fine as the
// volume's and are not turned. Nothing but the density is stored, nothing is refreshed.

/// Fraction bits that contact sums keep.
inline constexpr int kAlignedKeptBits = 8;

/// Voxels of a tool along one axis, at most.
inline constexpr std::int32_t kMaxAlignedEdge = 64;

/// A run of table entries that meets the box at `box_at` and the seven other corners' offsets.
struct AlignedChunk {
  std::int32_t box_at;  ///< entry of the box, as one stream
  std::int32_t vector;  ///< entry of `AlignedTable::vectors` where its run begins
};

/// What the method `aligned` holds of one tool, for kernels of one vector width. Made at load time
/// (controller/plan/tables/aligned_tool.hpp), constant afterwards; points into the maker's memory.
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

/// From the exact tap sum of one corner of the method `aligned` to density steps per voxel times
/// 2^8, rounded half up.
[[nodiscard]] constexpr std::int64_t kept_bits(const ExactTaps& taps, std::int64_t sum) noexcept {
  return round_shift(taps.factor * sum, taps.shift - kAlignedKeptBits);
}

}  // namespace kerf
