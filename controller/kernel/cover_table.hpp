// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

// What kernels of any instruction set weigh and cut of the voxels under a tool: plain structs.

/// Materials that a cut can tell apart; a label beyond counts as the last of them.
inline constexpr std::size_t kMaxCutMaterials = 64;

/// Neighbours along x that lie together.
inline constexpr std::int32_t kCoverGroup = 16;

/// Voxels of a row during one tick, of which the tool covers some; where it does not, `covered`
/// and `weight` are 0 and the voxel may lie outside of the volume.
struct CoveredGroup {
  std::uint32_t covered[kCoverGroup];  ///< density that may still leave, 15 fraction bits
  std::uint32_t weight[kCoverGroup];   ///< times speed
  std::uint16_t speed[kCoverGroup];    ///< of the tool's surface over its rim's; 2^15 is 1
  Label material[kCoverGroup];         ///< below kMaxCutMaterials; all alike unless `mixed`
  std::int64_t at;                     ///< entry of the volume of the first
  std::int16_t place[3];               ///< of the first
  bool mixed;
};

/// A row of overlap ratios and what is to be known about its voxels. Arrays may be read up to the
/// end of the last group, labels where there is an overlap.
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

/// Sums over the voxels of a row; by number of the voxel, the first being 0. Exact.
struct CoverSums {
  std::uint64_t covered, covered_number, weight, weight_speed;
};

/// How one budget is taken. A voxel of material m loses mantissa[m] 2^-shift[m] steps with 16
/// fraction bits per weight; the shifts are 0..63.
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
