// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

// For instruction sets that cannot store a vector in part. Internal linkage, for the reason given
// at KernelSet.

namespace kerf {
namespace {

/// density[begin + i] -= loss_i, as a whole vector: the entries that lose nothing, beyond the
/// tool's box or in the next row, are written back as they are. Near the ends of the volume's
/// memory, `count` densities, one by one: where bit i of `lost` is set.
template <class Simd>
[[gnu::always_inline]] inline void write_whole(std::uint16_t* density, std::ptrdiff_t begin,
                                               std::ptrdiff_t count, typename Simd::V loss,
                                               std::uint32_t lost) noexcept {
  if (begin >= 0 && begin + Simd::kLanes <= count) {
    Simd::store(density + begin, Simd::sub16(Simd::load(density + begin), loss));
    return;
  }
  alignas(sizeof(loss)) std::uint16_t entry[Simd::kLanes];
  Simd::store(entry, loss);
  for (; lost != 0; lost &= lost - 1) {
    const int i = __builtin_ctz(lost);
    density[begin + i] = static_cast<std::uint16_t>(density[begin + i] - entry[i]);
  }
}

}  // namespace
}  // namespace kerf
