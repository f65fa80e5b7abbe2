// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/sets/set_common.hpp"
#include "shared/volume/voxel_grid.hpp"

// Contact of the method `gather` for AVX2 and AVX-512; `Simd` as in box_vector.hpp.

namespace kerf {
namespace {

/// Samples between two widenings: sums of 16-bit halves of their pairs stay within 32 bits.
constexpr std::int32_t kGatherBlock = 65536;

/// Samples prepared before their gradients are read: two groups, whose latencies overlap.
constexpr std::int32_t kGatherBatch = 2 * kSampleGroup;

/// One group of samples, ready to meet the field: where each cell begins, and its weights.
struct GatherGroup {
  alignas(64) std::uint32_t at[kSampleGroup];       ///< voxel of the low corner; 0 outside
  alignas(64) std::uint32_t edge[4][kSampleGroup];  ///< two weights, negative; 0 outside
};

[[gnu::always_inline]] inline void prepare(const SampleTable& samples, const SamplePose& pose,
                                           const VoxelGrid& grid, std::int32_t first,
                                           std::int32_t count, GatherGroup& group) noexcept {
  alignas(64) std::int32_t place[3][kSampleGroup];
  SampleCells cells;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    place_along(samples, first, pose.centre[axis], pose.step[axis], place[axis]);
  }
  find_cells(place[0], place[1], place[2], cells);
  const auto last_x = static_cast<std::uint32_t>(grid.nx - 2);
  const auto last_y = static_cast<std::uint32_t>(grid.ny - 2);
  const auto last_z = static_cast<std::uint32_t>(grid.nz - 2);
  for (std::int32_t i = 0; i < kSampleGroup; ++i) {
    const std::int32_t x = cells.low[0][i], y = cells.low[1][i], z = cells.low[2][i];
    // All ones inside. A place below 0 is a large unsigned number.
    const std::uint32_t inside =
        0U - static_cast<std::uint32_t>((i < count) & (static_cast<std::uint32_t>(x) <= last_x) &
                                        (static_cast<std::uint32_t>(y) <= last_y) &
                                        (static_cast<std::uint32_t>(z) <= last_z));
    const std::uint32_t at =
        static_cast<std::uint32_t>(x) +
        static_cast<std::uint32_t>(grid.nx) *
            (static_cast<std::uint32_t>(y) +
             static_cast<std::uint32_t>(grid.ny) * static_cast<std::uint32_t>(z));
    group.at[i] = at & inside;
    for (std::int32_t e = 0; e < 4; ++e) {
      const auto near = static_cast<std::uint32_t>(-cells.weight[2 * e][i]);
      const auto far = static_cast<std::uint32_t>(-cells.weight[2 * e + 1][i]);
      group.edge[e][i] = ((near & 0xffff) | far << 16) & inside;
    }
  }
}

/// The weights are negative: -w fits 16 bits for every w of 0..32768, w does not. In one sum of 32
/// bits two samples fit, each at most 2^15 times a gradient.
void gather(const SampleTable& samples, const SamplePose& pose, const VoxelGrid& grid,
            const std::int16_t* field, std::int64_t (&sum)[3]) noexcept {
  sum[0] = sum[1] = sum[2] = 0;
  if (grid.nx < 2 || grid.ny < 2 || grid.nz < 2) return;
  const std::ptrdiff_t row = std::ptrdiff_t{3} * grid.nx, plane = row * grid.ny;
  const V low_half = Simd::set32(0xffff);
  for (std::int32_t block = 0; block < samples.count; block += kGatherBlock) {
    const std::int32_t end =
        samples.count - block < kGatherBlock ? samples.count : block + kGatherBlock;
    V low = Simd::zero(), high = Simd::zero();
    for (std::int32_t first = block; first < end; first += kGatherBatch) {
      alignas(64) std::uint32_t at[kGatherBatch];
      alignas(64) std::uint32_t weights[kGatherBatch][4];
      std::int32_t ready = 0;
      for (; ready < kGatherBatch && first + ready < end; ready += kSampleGroup) {
        GatherGroup group;
        prepare(samples, pose, grid, first + ready, end - first - ready, group);
        for (std::int32_t i = 0; i < kSampleGroup; ++i) at[ready + i] = group.at[i];
        Simd::transpose4(group.edge, weights + ready);
      }
      for (std::int32_t i = 0; i < ready; i += 2) {
        V pair = Simd::zero();
        Simd::add_cell(pair, field + std::ptrdiff_t{3} * at[i], row, plane, weights[i]);
        Simd::add_cell(pair, field + std::ptrdiff_t{3} * at[i + 1], row, plane, weights[i + 1]);
        low = Simd::add32(low, Simd::bit_and(pair, low_half));
        high = Simd::add32(high, Simd::upper16_of_32(pair));
      }
    }
    alignas(64) std::int32_t part_low[kLanes / 2], part_high[kLanes / 2];
    Simd::store(part_low, low);
    Simd::store(part_high, high);
    for (std::int32_t i = 0; i < kLanes / 2; ++i) {  // x, y, z, 0 for each edge
      if (i % 4 == 3) continue;
      sum[i % 4] -= static_cast<std::uint32_t>(part_low[i]) + std::int64_t{65536} * part_high[i];
    }
  }
}

}  // namespace
}  // namespace kerf
