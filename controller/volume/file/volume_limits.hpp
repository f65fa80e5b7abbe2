// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace kerf {

/// Largest volume that is read or made. Checked from the header, before any memory is taken.
inline constexpr std::int64_t kMaxVoxelsPerAxis = 1024;
inline constexpr std::int64_t kMaxVoxels = std::int64_t{512} << 20;

/// Throws SceneError where an extent is not positive or above the limits. `place` begins the
/// message, `way_out` ends it where the extents are too large.
void check_grid(const std::string& place, std::int64_t nx, std::int64_t ny, std::int64_t nz,
                const char* way_out = "crop or resample it first");

/// Throws SceneError unless each spacing is finite and within 1 nm .. 1 m.
void check_spacing(const std::string& place, const std::array<double, 3>& spacing_mm);

}  // namespace kerf
