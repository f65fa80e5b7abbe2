// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/volume/voxel_grid.hpp"

// The inner loops of a tick in fixed point, one set per instruction set (`KernelSet`), and the
// plain structs that they take. Code of an instruction set may include this file: it holds structs,
// sizes and `always_inline` functions only.

namespace kerf {

/// For so many samples the sum of exact gradients, times 2^15 each, stays below 2^62.
inline constexpr std::size_t kNarrowSumSamples = 18'000;

/// Bits that are dropped from the finished sum of a tool with so many samples: none, or 16.
[[nodiscard]] constexpr int sum_shift(std::size_t samples) noexcept {
  return samples <= kNarrowSumSamples ? 0 : 16;
}

/// SUM of terms over 2^shift, rounded down once at the end: the order of terms does not matter.
/// With a shift of 16 the sum may have 79 bits.
struct WideSum {
  std::int64_t high = 0, low = 0;

  [[gnu::always_inline]] constexpr void add(std::int64_t term, int shift) noexcept {
    high += term >> shift;
    low += term & ((std::int64_t{1} << shift) - 1);
  }
  [[gnu::always_inline]] [[nodiscard]] constexpr std::int64_t over(int shift) const noexcept {
    return high + (low >> shift);
  }
};

/// Gradient taps without the common factor of their slopes: the factor is applied once, to the
/// finished sum, which is then divided by 2^shift. Exact sums are before both.
struct ExactTaps {
  std::int32_t smooth[5];
  std::int32_t slope[5];
  std::int32_t factor;
  std::int32_t shift;
};

inline constexpr ExactTaps kExactFarid{{5, 32, 55, 32, 5}, {-2, -5, 0, 5, 2}, 7, 21};
inline constexpr ExactTaps kExactSobel5{{1, 4, 6, 4, 1}, {-1, -2, 0, 2, 1}, 1, 11};
/// The central difference, scaled as sobel5.
inline constexpr ExactTaps kExactCentral{{0, 0, 32, 0, 0}, {0, -1, 0, 1, 0}, 1, 11};

/// The exact gradient of a voxel, times 2^21 / 7, is at most this for farid, less for sobel5: half
/// the slope taps' sum times the smooth taps' squared, times full density.
inline constexpr std::int64_t kMaxExactGradient = std::int64_t{7} * 129 * 129 * 65535;
static_assert(kNarrowSumSamples <= (std::uint64_t{1} << 62) / 32768 / kMaxExactGradient);

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
  int sum_shift = 0;           ///< of sums of exact gradients, set by `exact_taps` below
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
/// live rows may be missing if nothing is milled.
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

// The method `aligned` (docs/forces.md 7.6): the tool's voxels lie on a lattice as fine as that of
// the volume and are not rotated. Only the density is stored; a cut refreshes nothing.

/// Fraction bits that contact sums keep.
inline constexpr int kAlignedKeptBits = 8;

/// Voxels of a tool along one axis, at most.
inline constexpr std::int32_t kMaxAlignedEdge = 64;

/// A run of table entries that meets the box at `box_at` and the seven other corners' offsets.
struct AlignedChunk {
  std::int32_t box_at;  ///< entry of the box, as one stream
  std::int32_t vector;  ///< first entry of its run in `AlignedTable::vectors`
};

/// The tables of one tool for the method `aligned`, for kernels of one vector width. Made at load
/// time (controller/plan/tables/sample_tables.hpp), constant afterwards; points into the maker's
/// memory.
///
/// A table entry has up to 18 bits, stored as 512 hi + lo, both in 16 bits. A run is `lanes`
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

/// A tool's samples for kernels of any vector width: offsets in half pitches, axis by axis. Made at
/// load (controller/plan/tables/sample_tables.hpp); points into the maker's memory. Each array goes
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

// The method `splat` (docs/forces.md 7.6): any pose of any shape, in scenes that cut. Forces and
// removal need only the sums PHI_j of the samples' weights. Only the density is stored; a cut
// refreshes nothing.

/// Most samples per voxel in a sum: 2^24 of weights of 2^15, so that 5 taps of it fit 32
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

// Plain structs for the kernels that weigh and cut the voxels under a tool (docs/forces.md 6.2).

/// Most materials of a cut; a larger label counts as the last of them.
inline constexpr std::size_t kMaxCutMaterials = 64;

/// Voxels of a group: neighbours along x.
inline constexpr std::int32_t kCoverGroup = 16;

/// A group of voxels, of which the tool covers some, during one tick. A voxel that it does not
/// cover has `covered` and `weight` 0, and may lie outside of the volume.
struct CoveredGroup {
  std::uint32_t covered[kCoverGroup];  ///< density that may still leave, 15 fraction bits
  std::uint32_t weight[kCoverGroup];   ///< times speed
  std::uint16_t speed[kCoverGroup];    ///< of the tool's surface over its rim's; 2^15 is 1
  Label material[kCoverGroup];         ///< below kMaxCutMaterials; all alike unless `mixed`
  std::int64_t at;                     ///< index of the first voxel in the volume
  std::int16_t place[3];               ///< voxel of the first: x, y, z
  bool mixed;
};

/// A row of overlap ratios with the data for weighing its voxels. Arrays may be read to the end of
/// the last group, labels only of voxels whose overlap is not 0.
struct CoverRow {
  const std::int16_t* ratio = nullptr;    ///< minus the overlap, 2^15 is 1; 0 outside of the volume
  const std::int16_t* density = nullptr;  ///< less 2^15
  std::int32_t count = 0;                 ///< voxels
  VoxelIndex first = {};                  ///< may lie before the volume
  std::int64_t at = 0;                    ///< its entry
  const Label* labels = nullptr;          ///< nullptr: all voxels are material 0
  std::int64_t label_count = 0;
  std::int64_t place[2] = {};  ///< of the first beside the spindle's axis, rims; 20 fraction bits
  std::int64_t step[2] = {};   ///< to the next
  const std::uint32_t* roots = nullptr;  ///< `kSpeedRoots`
  std::int32_t slowest = 0;              ///< least speed
};

/// Exact sums over voxels. `covered_number` is the sum of index times covered; the first voxel has
/// the index 0.
struct CoverSums {
  std::uint64_t covered, covered_number, weight, weight_speed;
};

/// How much a voxel counts at a contact of the tool, as a linear form of its position: fully at 1
/// and more, not at all at 0 and less (covered_voxels.hpp).
template <class Sum>
struct AheadForm {
  Sum origin;   ///< of voxel 0, 0, 0; fixed: 20 fraction bits, as have the steps
  Sum step[3];  ///< from a voxel to the next
};

/// How the budget of one tick is spent: a voxel of material m loses weight * mantissa[m]
/// 2^-shift[m] density steps, with 16 fraction bits; the shifts are 0..63.
struct CoverSpend {
  std::uint32_t mantissa[kMaxCutMaterials], shift[kMaxCutMaterials];
  std::uint16_t phase;           ///< of the rounding
  std::uint16_t phase_by_voxel;  ///< it goes on by so much an entry
};

/// The loss of one group.
struct TakenLanes {
  std::uint32_t steps[kCoverGroup];
  std::uint32_t sum;    ///< of the steps
  std::uint32_t lanes;  ///< bits: those that lost something
  bool full;            ///< a voxel had less left than its part
};

/// The loss of all groups.
struct CoverTaken {
  std::uint64_t steps[kMaxCutMaterials];  ///< by material
  VoxelIndex lo, hi;                      ///< last one excluded; unchanged if nothing left
  bool full;                              ///< a voxel had less left than its part
};

/// The part of a removal rate that a kernel needs: mantissa 2^-(15 + exponent).
struct CutRate {
  std::uint16_t mantissa;
  std::int32_t exponent;  ///< 0..32
};

/// The loss of one cut; `lo` and `hi` (last one included) are box entries, meaningless when 0
/// steps.
struct BoxCut {
  std::uint64_t density_steps;
  VoxelIndex lo, hi;
};

/// The inner loops of a tick in fixed point, for one instruction set: those of every method, of the
/// cut by force and of the swept contact. All sets give the same bits.
///
/// Plain pointers and plain structs: these functions are compiled with instructions that other
/// machines lack, so nothing that the linker could share with other files may be inlined here.
struct KernelSet {
  const char* name;
  std::int32_t lanes;  ///< the width that tables are made for
  bool can_fuse;       ///< has registers for three axes at a time
  /// Copies the box at `origin`; densities outside the volume are 0.
  void (*copy_box)(const TickBox&, const VoxelGrid&, const Density*, VoxelIndex origin,
                   const BoxScratch&) noexcept;
  /// Exact sums by axis and corner 4 k + 2 j + i.
  void (*correlate)(const AlignedTable&, const std::int16_t* box,
                    std::int64_t (&sum)[3][8]) noexcept;
  /// Overlap ratios of all rows with density, and the exact modification sum.
  void (*press)(const AlignedTable&, const std::int32_t (&weight)[8], const BoxScratch&,
                std::int64_t (&sum)[3]) noexcept;
  /// Removes density from the volume by the ratios; `carry` has row_lanes entries.
  BoxCut (*cut)(const TickBox&, const CutRate&, const VoxelGrid&, Density*, VoxelIndex origin,
                const BoxScratch&, std::uint16_t* carry) noexcept;
  /// Contact of the method `gather`: `contact_sum` over a field of three 16-bit parts a voxel,
  /// which goes on for kFieldPad voxels.
  void (*gather)(const SampleTable&, const SamplePose&, const VoxelGrid&, const std::int16_t* field,
                 std::int64_t (&sum)[3]) noexcept;
  /// Method `splat`: places of the samples, then their sums, then both sums of gradients; the
  /// ratios are left for `cut`.
  void (*place)(const SampleTable&, const SamplePose&, const SplatScratch&, VoxelIndex& lowest,
                VoxelIndex& highest) noexcept;
  void (*splat)(const SampleTable&, const TickBox&, VoxelIndex origin,
                const SplatScratch&) noexcept;
  void (*press_sums)(const TickBox&, std::int32_t volume_ratio, const SplatScratch&,
                     std::int64_t (&contact)[3], std::int64_t (&modification)[3]) noexcept;
  /// Where force cuts: the ratios of `press` and of `press_sums` alone.
  void (*cover)(const AlignedTable&, const std::int32_t (&weight)[8], const BoxScratch&) noexcept;
  void (*cover_sums)(const TickBox&, std::int32_t volume_ratio, const SplatScratch&) noexcept;
  /// Weighing and cutting with these ratios, by rows and then by groups of voxels
  /// (covered_voxels.hpp).
  std::int32_t (*weigh_row)(const CoverRow&, CoveredGroup* list, std::int32_t room, CoverSums&,
                            std::uint64_t* weight_by_material) noexcept;
  void (*weigh_again)(CoveredGroup* list, std::int32_t count,
                      std::uint64_t* weight_by_material) noexcept;
  /// `ahead` and `bearing` by material: `loads` (covered_voxels.hpp).
  void (*add_loads)(const AheadForm<std::int64_t>&, const CoveredGroup* list, std::int32_t count,
                    const Density*, std::int64_t entries, Density iso, std::uint64_t* ahead,
                    std::uint64_t* bearing) noexcept;
  void (*take_steps)(const CoverSpend&, CoveredGroup* list, std::int32_t count, Density*,
                     std::int64_t entries, CoverTaken&) noexcept;
  /// The swept contact: `transform_points`, `point_sums` and `read_points` of a tool's surface
  /// samples.
  void (*transform_points)(const PointTable<FixedNumbers>&, const PointStep<FixedNumbers>&,
                           const PointPositions<FixedNumbers>&) noexcept;
  void (*sum_points)(const PointTable<FixedNumbers>&, const PointPositions<FixedNumbers>&,
                     const std::int32_t (&centre)[3], const DensityField&,
                     PointSums<FixedNumbers>&) noexcept;
  void (*read_points)(const PointPositions<FixedNumbers>&, std::int32_t count,
                      const std::int32_t (&centre)[3], const DensityField&,
                      std::int32_t* density) noexcept;
  /// `close_sums`.
  void (*sum_close)(const CloseSampleView<FixedNumbers>&, CloseSums<FixedNumbers>&) noexcept;
};

/// Gradients beyond the last voxel of a field.
inline constexpr std::size_t kFieldPad = 1;

extern const KernelSet kScalarSet;
#if defined(KERF_X86_KERNELS)
extern const KernelSet kAvx2Set;
extern const KernelSet kAvx512Set;
#elif defined(KERF_NEON_KERNELS)
extern const KernelSet kNeonSet;
#endif

/// Kernels that this machine can run and that are not hidden (shared/numeric/hidden_set.hpp), the
/// fastest first; ends with nullptr, holds at least one. Load time.
[[nodiscard]] const KernelSet* const* kernel_sets() noexcept;

}  // namespace kerf
