// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/free_bricks.hpp"
#include "controller/kernel/point_shell/point_table.hpp"

// Which groups of a point shell have something to read, as loops that a compiler turns into
// vectors; internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

/// The groups of a point shell that are not in free space, in order.
struct OpenGroups {
  std::int32_t count = 0;
  std::int32_t group[kMaxShellPoints / kPointGroup];
};

/// Those from `begin` to `end`, as `FreeBricks::at` tells: brick by brick in vectors, and then
/// without a branch that waits for the map. `kInside`: all are known to be in the volume. What goes
/// round beyond 2^15 voxels is outside before and after.
template <bool kInside>
void find_open(const PointTable<FixedNumbers>& table, const PointPlaces<FixedNumbers>& places,
               const std::int32_t (&centre)[3], const FreeBricks& free, std::int32_t begin,
               std::int32_t end, OpenGroups& open) noexcept {
  constexpr int kToBrick = 17;  // from Q15.16
  static_assert(kFreeBrick << 16 == 1 << kToBrick);
  const std::int32_t size[3] = {free.grid.nx, free.grid.ny, free.grid.nz};
  std::int32_t brick[kMaxShellPoints / kPointGroup], outside[kMaxShellPoints / kPointGroup];
  for (std::int32_t i = begin; i < end; ++i) brick[i] = outside[i] = 0;
  for (std::size_t axis = 3; axis-- > 0;) {
    const std::int32_t* const middle = places.middle[axis];
    const auto at = static_cast<std::uint32_t>(centre[axis]);
    const std::int32_t n = size[axis];
    for (std::int32_t i = begin; i < end; ++i) {
      const auto place = static_cast<std::int32_t>(at + static_cast<std::uint32_t>(middle[i]));
      std::int32_t along = place >> kToBrick;
      if constexpr (!kInside) {
        outside[i] = FreeBricks::larger(outside[i], FreeBricks::beyond(place >> 16, n));
        along = FreeBricks::within(along, n);
      }
      brick[i] = brick[i] * n + along;
    }
  }
  open.count = 0;
  for (std::int32_t i = begin; i < end; ++i) {
    std::int32_t distance = 0;
    if (free.distance != nullptr) {
      distance = free.distance[brick[i]];
      if constexpr (!kInside) distance = FreeBricks::at_least(distance, outside[i]);
    }
    open.group[open.count] = i;
    open.count += distance < table.needed[i] ? 1 : 0;
  }
}

}  // namespace
}  // namespace kerf
