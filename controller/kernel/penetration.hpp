// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "controller/kernel/tool_pose.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// How far the tool reaches into the solid along `normal`: largest minus smallest `position .
/// normal` over the tool samples whose nearest voxel has at least density `iso`; 0 when there is
/// none.
///
/// In voxels for a unit normal. A normal times mm per voxel, axis by axis, gives mm (up to 1.99 mm
/// per voxel in fixed). For a ball that sinks d into a flat: more than d + 1/2 voxel - pitch, at
/// most d + 1/2 voxel, since a sample takes the density of its nearest voxel. For reports and
/// display.
template <class N>
[[nodiscard]] constexpr typename N::Real penetration_extent(
    const VoxelGrid& grid, std::span<const Density> density, std::span<const ToolOffset> offsets,
    const ToolPose<N>& pose, Density iso, VoxelVec<typename N::Unit> normal) noexcept {
  using Real = typename N::Real;
  const auto nearest = [](Real at) {
    if constexpr (N::kIsFixed) {
      return static_cast<std::int32_t>(round_shift(at.raw(), 16));
    } else {
      const Real up = at + Real(0.5);
      const auto whole = static_cast<std::int32_t>(up);
      return Real(whole) > up ? whole - 1 : whole;
    }
  };
  // Along the normal from the tool centre, with 16 fraction bits in fixed.
  const auto along = [&](VoxelVec<Real> at) {
    if constexpr (N::kIsFixed) {
      const auto term = [](Real a, Real centre, typename N::Unit n) {
        return round_shift((std::int64_t{a.raw()} - centre.raw()) * n.raw(), 30);
      };
      return term(at.x, pose.centre_vox.x, normal.x) + term(at.y, pose.centre_vox.y, normal.y) +
             term(at.z, pose.centre_vox.z, normal.z);
    } else {
      return dot(at - pose.centre_vox, normal);
    }
  };
  using Along = decltype(along(pose.centre_vox));
  Along lowest{}, highest{};
  bool found = false;
  for (const ToolOffset& offset : offsets) {
    const VoxelVec<Real> at = sample_position(pose, offset);
    const VoxelIndex v{nearest(at.x), nearest(at.y), nearest(at.z)};
    if (!grid.contains(v) || density[grid.index(v.x, v.y, v.z)] < iso) continue;
    const Along place = along(at);
    lowest = found ? std::min(lowest, place) : place;
    highest = found ? std::max(highest, place) : place;
    found = true;
  }
  if constexpr (N::kIsFixed) {
    return Real::from_raw(saturate_i32(highest - lowest));
  } else {
    return highest - lowest;
  }
}

}  // namespace kerf
