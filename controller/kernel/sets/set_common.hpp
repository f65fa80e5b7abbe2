// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(KERF_X86_KERNELS)
#include <immintrin.h>
#endif

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/point_shell/point_table.hpp"

// Loops and helpers of several instruction sets, mostly loops that a compiler turns into vectors.
// Included by the translation units of the instruction sets only; all of it has internal linkage,
// for the reason given at KernelSet.

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

/// Transforms offsets of a point shell to voxels.
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

/// `transform_points` of every instruction set.
void place_point_samples(const PointTable<FixedNumbers>& table, const PointStep<FixedNumbers>& step,
                         const PointPositions<FixedNumbers>& places) noexcept {
  place_offsets(table.offset, step, table.count, places.offset_vox);
  place_offsets(table.middle, step, table.groups, places.middle);
  for (std::int32_t i = table.count; i < table.groups * kPointGroup; ++i) {
    places.offset_vox[0][i] = kNoSampleVox << 16;
  }
}

/// The groups of a point shell that are not in free space, in order.
struct OpenGroups {
  std::int32_t count = 0;
  std::int32_t group[kMaxShellPoints / kPointGroup];
};

/// Lists those from `begin` to `end` by `FreeSpaceMap::at`: the bricks in vectors, and then without
/// a branch that waits for the map. `kInside`: all are known to be in the volume. A position that
/// wraps beyond 2^15 voxels is outside before and after.
template <bool kInside>
void find_open(const PointTable<FixedNumbers>& table, const PointPositions<FixedNumbers>& places,
               const std::int32_t (&centre)[3], const FreeSpaceMap& free, std::int32_t begin,
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
        outside[i] = FreeSpaceMap::larger(outside[i], FreeSpaceMap::beyond(place >> 16, n));
        along = FreeSpaceMap::within(along, n);
      }
      brick[i] = brick[i] * n + along;
    }
  }
  open.count = 0;
  for (std::int32_t i = begin; i < end; ++i) {
    std::int32_t distance = 0;
    if (free.distance != nullptr) {
      distance = free.distance[brick[i]];
      if constexpr (!kInside) distance = FreeSpaceMap::at_least(distance, outside[i]);
    }
    open.group[open.count] = i;
    open.count += distance < table.needed[i] ? 1 : 0;
  }
}

/// Voxel of the row at which a group of kCoverGroup begins. Bit i of `lanes`, not 0, is set if
/// the tool covers voxel `lane` + i. The group begins at the first covered voxel; near the end of
/// the row it begins earlier, never before `lane`, so that it reaches no farther beyond the end
/// than one from `lane` on would.
[[gnu::always_inline]] inline std::int32_t group_begin(const CoverRow& row, std::int32_t lane,
                                                       std::uint32_t lanes) noexcept {
  const std::int32_t first = lane + __builtin_ctz(lanes), last = row.count - kCoverGroup;
  const std::int32_t end = last > lane ? last : lane;
  return first < end ? first : end;
}

/// density[begin + i] -= loss_i, for instruction sets without masked stores: entries without a
/// loss, beyond the tool's box or in the next row, are written back unchanged. Near the ends of the
/// volume's memory, `count` densities, one by one: those whose bit i of `lost` is set.
template <class Vector>
[[gnu::always_inline]] inline void write_whole(std::uint16_t* density, std::ptrdiff_t begin,
                                               std::ptrdiff_t count, typename Vector::V loss,
                                               std::uint32_t lost) noexcept {
  if (begin >= 0 && begin + Vector::kLanes <= count) {
    Vector::store(density + begin, Vector::sub16(Vector::load(density + begin), loss));
    return;
  }
  alignas(sizeof(loss)) std::uint16_t entry[Vector::kLanes];
  Vector::store(entry, loss);
  for (; lost != 0; lost &= lost - 1) {
    const int i = __builtin_ctz(lost);
    density[begin + i] = static_cast<std::uint16_t>(density[begin + i] - entry[i]);
  }
}

#if defined(KERF_X86_KERNELS)
/// The densities i and i + 1 of each of four indices i, the first in the low half. For AVX2 and
/// AVX-512, by single loads: a gather takes twice as long on Zen 4.
[[gnu::always_inline]] inline __m128i load_four_pairs(const std::uint16_t* density,
                                                      const std::uint32_t* index) noexcept {
  const auto pair = [&](int lane) {
    std::int32_t both;
    std::memcpy(&both, density + index[lane], sizeof both);
    return both;
  };
  return _mm_setr_epi32(pair(0), pair(1), pair(2), pair(3));
}
#endif

}  // namespace
}  // namespace kerf
