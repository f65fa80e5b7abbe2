// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace kerf {

/// A sample of a tool's surface, in the tool's axes.
struct SurfaceSample {
  std::array<double, 3> at;      ///< from the tool's centre
  std::array<double, 3> normal;  ///< outward, of length 1; 0 on a rim or a point, which have many
};

}  // namespace kerf
