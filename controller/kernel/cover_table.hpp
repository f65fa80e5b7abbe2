// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

// Plain structs for the kernels that weigh and cut the voxels under a tool (docs/theory.md 6.2).

/// Materials that a cut can tell apart; a label beyond counts as the last of them.
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

/// A row of overlap ratios and what weighing needs to know of its voxels. Arrays may be read to the
/// end of the last group, labels only where the overlap is not 0.
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

/// Sums over voxels; `covered_number` weights `covered` with the voxel's number, the first being 0.
/// Exact.
struct CoverSums {
  std::uint64_t covered, covered_number, weight, weight_speed;
};

/// How far a voxel lies at a contact of the tool, as a linear form of its place: 1 and more bear
/// all, 0 and less nothing (covered_loads.hpp).
template <class Sum>
struct AheadForm {
  Sum origin;   ///< of voxel 0, 0, 0; fixed: 20 fraction bits, as have the steps
  Sum step[3];  ///< from a voxel to the next
};

/// How one tick's budget is taken: a voxel of material m loses weight * mantissa[m] 2^-shift[m]
/// density steps, with 16 fraction bits; the shifts are 0..63.
struct CoverSpend {
  std::uint32_t mantissa[kMaxCutMaterials], shift[kMaxCutMaterials];
  std::uint16_t phase;           ///< of the rounding
  std::uint16_t phase_by_voxel;  ///< it goes on by so much an entry
};

/// What a group lost.
struct TakenLanes {
  std::uint32_t steps[kCoverGroup];
  std::uint32_t sum;    ///< of the steps
  std::uint32_t lanes;  ///< bits: those that lost something
  bool full;            ///< one had less to give than its part
};

/// What all of them lost.
struct CoverTaken {
  std::uint64_t steps[kMaxCutMaterials];  ///< by material
  VoxelIndex lo, hi;                      ///< last one excluded; as they were where nothing left
  bool full;                              ///< a voxel had less to give than its part
};

}  // namespace kerf
