// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace kerf {

/// Offset of a tool voxel from the tool centre in half pitches, so that even and odd grids are both
/// exact: position = offset * pitch / 2.
using ToolOffset = std::array<std::int16_t, 3>;

}  // namespace kerf
