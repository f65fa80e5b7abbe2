// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/splat_table.hpp"

// Places and weights of samples as loops that a compiler turns into vectors. Included by the
// translation units of the instruction sets only; all of it has internal linkage, for the reason
// given at KernelSet.

namespace kerf {
namespace {

/// `sample_position` along one axis of kSampleGroup samples from `first` on, Q15.16.
[[gnu::always_inline]] inline void place_along(const SampleTable& samples, std::int32_t first,
                                               std::int32_t centre, const std::int32_t (&step)[3],
                                               std::int32_t* place) noexcept {
  const std::int32_t *x = samples.offset[0] + first, *y = samples.offset[1] + first,
                     *z = samples.offset[2] + first;
  for (std::int32_t i = 0; i < kSampleGroup; ++i) {
    place[i] = centre + ((step[0] * x[i] + step[1] * y[i] + step[2] * z[i] + 16) >> 5);
  }
}

/// Cell and weights of kSampleGroup samples: `trilinear_weights` of `cell_at`.
struct SampleCells {
  alignas(64) std::int32_t low[3][kSampleGroup];
  alignas(64) std::int32_t weight[8][kSampleGroup];  ///< corner 4 k + 2 j + i
};

[[gnu::always_inline]] inline void find_cells(const std::int32_t* x, const std::int32_t* y,
                                              const std::int32_t* z, SampleCells& cells) noexcept {
  constexpr std::int32_t kOne = 1 << 15, kHalf = 1 << 14;
  for (std::int32_t i = 0; i < kSampleGroup; ++i) {
    cells.low[0][i] = x[i] >> 16;
    cells.low[1][i] = y[i] >> 16;
    cells.low[2][i] = z[i] >> 16;
    const std::int32_t wx = ((x[i] & 0xffff) + 1) >> 1, wy = ((y[i] & 0xffff) + 1) >> 1,
                       wz = ((z[i] & 0xffff) + 1) >> 1;
    const std::int32_t yz = (wy * wz + kHalf) >> 15;
    const std::int32_t edge[4] = {kOne - wy - wz + yz, wy - yz, wz - yz, yz};
    for (std::int32_t q = 0; q < 4; ++q) {
      const std::int32_t far = (wx * edge[q] + kHalf) >> 15;
      cells.weight[2 * q][i] = edge[q] - far;
      cells.weight[2 * q + 1][i] = far;
    }
  }
}

}  // namespace
}  // namespace kerf
