// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace kerf {

/// A tool's samples for kernels of any vector width: offsets in half pitches, axis by axis. Made at
/// load (controller/plan/tables/sample_tool.hpp); points into the maker's memory. Each array goes
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

}  // namespace kerf
