// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_table.hpp"

// Places of a point shell as loops that a compiler turns into vectors, one text for every
// instruction set; internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

[[gnu::always_inline]] inline void place_offsets(const std::int32_t* const (&offset)[3],
                                                 const PointStep<FixedNumbers>& step,
                                                 std::int32_t count,
                                                 std::int32_t* const (&out)[3]) noexcept {
  const std::int32_t *x = offset[0], *y = offset[1], *z = offset[2];
  const std::int32_t shift = step.shift, half = 1 << (shift - 1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Copies, which no store can change.
    const std::int32_t a = step.row[axis][0], b = step.row[axis][1], c = step.row[axis][2];
    std::int32_t* const to = out[axis];
    for (std::int32_t i = 0; i < count; ++i)
      to[i] = (a * x[i] + b * y[i] + c * z[i] + half) >> shift;
  }
}

void place_point_samples(const PointTable<FixedNumbers>& table, const PointStep<FixedNumbers>& step,
                         const PointPlaces<FixedNumbers>& places) noexcept {
  place_offsets(table.offset, step, table.count, places.offset_vox);
  place_offsets(table.middle, step, table.groups, places.middle);
  for (std::int32_t i = table.count; i < table.groups * kPointGroup; ++i) {
    places.offset_vox[0][i] = kNoSampleVox << 16;
  }
}

}  // namespace
}  // namespace kerf
