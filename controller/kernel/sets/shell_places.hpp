// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/shell_table.hpp"

// Places of a shell as loops that a compiler turns into vectors, one text for every instruction
// set; internal linkage, for the reason told at KernelSet.

namespace kerf {
namespace {

[[gnu::always_inline]] inline void place_levers(const std::int32_t* const (&lever)[3],
                                                const ShellStep<FixedNumbers>& step,
                                                std::int32_t count,
                                                std::int32_t* const (&out)[3]) noexcept {
  const std::int32_t *x = lever[0], *y = lever[1], *z = lever[2];
  const std::int32_t shift = step.shift, half = 1 << (shift - 1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Copies, which no store can change.
    const std::int32_t a = step.row[axis][0], b = step.row[axis][1], c = step.row[axis][2];
    std::int32_t* const to = out[axis];
    for (std::int32_t i = 0; i < count; ++i)
      to[i] = (a * x[i] + b * y[i] + c * z[i] + half) >> shift;
  }
}

void place_shell_samples(const ShellTable<FixedNumbers>& table, const ShellStep<FixedNumbers>& step,
                         const ShellPlaces<FixedNumbers>& places) noexcept {
  place_levers(table.lever, step, table.count, places.offset);
  place_levers(table.middle, step, table.groups, places.middle);
  for (std::int32_t i = table.count; i < table.groups * kShellGroup; ++i) {
    places.offset[0][i] = kNoSampleVox << 16;
  }
}

}  // namespace
}  // namespace kerf
