// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <span>

#include "shared/segment/layout.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {

/// Length of a vector of a record.
[[nodiscard]] inline double magnitude(const float (&vector)[3]) noexcept {
  return std::sqrt(double{vector[0]} * vector[0] + double{vector[1]} * vector[1] +
                   double{vector[2]} * vector[2]);
}

/// Volume taken away in one tick: density units over full density, times the voxel of the volume
/// that changed (the first one, where a tick changed several).
[[nodiscard]] inline double removed_mm3(const TickRecord& record,
                                        std::span<const double> voxel_mm3) noexcept {
  if (record.removed == 0 || voxel_mm3.empty()) return 0;
  const auto changed = static_cast<std::size_t>(std::countr_zero(record.dirty_volumes));
  const double voxel = voxel_mm3[changed < voxel_mm3.size() ? changed : 0];
  return record.removed / kDensityMax * voxel;
}

}  // namespace kerf
