// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Offset of a tool voxel from the tool centre in half pitches, so that even and odd grids are both
/// exact: position = offset * pitch / 2.
using ToolOffset = std::array<std::int16_t, 3>;

/// A sum over samples or voxels, one component per voxel axis; never saturates.
template <class N>
using SumVec = VoxelVec<typename N::Sum>;

/// Where the tool is in one volume: sample i lies at `centre_vox + step * offset_i / 2`, since
/// offsets are in half pitches.
///
/// `step[a][b]` is the displacement along voxel axis a for one pitch along tool axis b: rotation
/// times pitch over spacing, Q11.20 in fixed. Made once per tick and volume.
template <class N>
struct ToolPose {
  VoxelVec<typename N::Real> centre_vox;
  std::array<std::array<typename N::Step, 3>, 3> step{};
};

/// No sample lies farther out than this on any axis. A volume must be smaller, so a sample at the
/// limit is outside every volume.
inline constexpr std::int32_t kPositionLimitVox = 1 << 14;

/// Position of one tool sample. A place beyond the limit, or NaN, becomes the limit.
///
/// Fixed: exact products, one rounding to Q15.16, half up. Floating: x, y, z products in this
/// order.
template <class N>
[[nodiscard]] constexpr VoxelVec<typename N::Real> sample_position(
    const ToolPose<N>& pose, const ToolOffset& offset) noexcept {
  using Real = typename N::Real;
  const auto along = [&](Real centre, const std::array<typename N::Step, 3>& step) {
    if constexpr (N::kIsFixed) {
      constexpr std::int64_t kLimit = std::int64_t{kPositionLimitVox} << Real::kFractionBits;
      const std::int64_t rotated = std::int64_t{step[0]} * offset[0] +
                                   std::int64_t{step[1]} * offset[1] +
                                   std::int64_t{step[2]} * offset[2];
      // 20 fraction bits times half pitches: 21 bits down to 16.
      const std::int64_t place = centre.raw() + round_shift(rotated, 5);
      return Real::from_raw(static_cast<std::int32_t>(place < -kLimit  ? -kLimit
                                                      : place > kLimit ? kLimit
                                                                       : place));
    } else {
      constexpr Real kLimit = Real(kPositionLimitVox);
      const Real rotated =
          step[0] * Real(offset[0]) + step[1] * Real(offset[1]) + step[2] * Real(offset[2]);
      const Real place = centre + rotated * Real(0.5);
      return place > -kLimit ? (place < kLimit ? place : kLimit) : -kLimit;
    }
  };
  return {along(pose.centre_vox.x, pose.step[0]), along(pose.centre_vox.y, pose.step[1]),
          along(pose.centre_vox.z, pose.step[2])};
}

}  // namespace kerf
