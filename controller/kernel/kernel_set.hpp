// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/cover_table.hpp"
#include "controller/kernel/point_shell/close_sums.hpp"
#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/splat_table.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// The part of a removal rate that a kernel needs: mantissa 2^-(15 + exponent).
struct CutRate {
  std::uint16_t mantissa;
  std::int32_t exponent;  ///< 0..32
};

/// What one cut took; `lo` and `hi` (last one included) are box entries, meaningless when 0 steps.
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
  /// Overlap ratios of all rows where there is density, and the exact modification sum.
  void (*press)(const AlignedTable&, const std::int32_t (&weight)[8], const BoxScratch&,
                std::int64_t (&sum)[3]) noexcept;
  /// Takes from the volume what the ratios say; `carry` has row_lanes entries.
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
  /// And what is done with them, by rows and then by groups of voxels (covered_groups.hpp).
  std::int32_t (*weigh_row)(const CoverRow&, CoveredGroup* list, std::int32_t room, CoverSums&,
                            std::uint64_t* weight_by_material) noexcept;
  void (*weigh_again)(CoveredGroup* list, std::int32_t count,
                      std::uint64_t* weight_by_material) noexcept;
  /// `ahead` and `bearing` by material: `loads` (covered_loads.hpp).
  void (*add_loads)(const AheadForm<std::int64_t>&, const CoveredGroup* list, std::int32_t count,
                    const Density*, std::int64_t entries, Density iso, std::uint64_t* ahead,
                    std::uint64_t* bearing) noexcept;
  void (*take_steps)(const CoverSpend&, CoveredGroup* list, std::int32_t count, Density*,
                     std::int64_t entries, CoverTaken&) noexcept;
  /// The swept contact: `place_points`, `point_sums` and `read_points` of a tool's surface samples.
  void (*place_points)(const PointTable<FixedNumbers>&, const PointStep<FixedNumbers>&,
                       const PointPlaces<FixedNumbers>&) noexcept;
  void (*sum_points)(const PointTable<FixedNumbers>&, const PointPlaces<FixedNumbers>&,
                     const std::int32_t (&centre)[3], const DensityField&,
                     PointSums<FixedNumbers>&) noexcept;
  void (*read_points)(const PointPlaces<FixedNumbers>&, std::int32_t count,
                      const std::int32_t (&centre)[3], const DensityField&,
                      std::int32_t* density) noexcept;
  /// `close_sums`.
  void (*sum_close)(const CloseLook<FixedNumbers>&, CloseSums<FixedNumbers>&) noexcept;
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

/// Kernels that this machine can run, the fastest first; ends with nullptr, holds at least one.
/// Load time.
[[nodiscard]] const KernelSet* const* kernel_sets() noexcept;

}  // namespace kerf
