// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/tick_box.hpp"

namespace kerf {

/// The overlap ratios that `press` of the methods `aligned` and `splat` left in the scratch, until
/// the next tick uses it; nothing where the tool is away from the volume.
struct BoxOverlap {
  const TickBox* box = nullptr;
  BoxScratch scratch;
  VoxelIndex origin;  ///< low corner of the box
};

/// A row of it: the ratio of the voxel i behind the first along x, 0..kWeightOne.
struct StoredRow {
  const std::int16_t* ratio;    ///< negative
  const std::int16_t* density;  ///< less 2^15

  [[nodiscard]] constexpr std::int32_t operator()(std::int32_t i) const noexcept {
    return -std::int32_t{ratio[i]};
  }
};

/// Calls `row(first, count, ratio)` for every row of the overlap inside the volume, in z, y order:
/// `ratio(i)` is the ratio of the voxel i behind `first` along x, 0..kWeightOne. Rows without an
/// overlap may be left out.
template <class Row>
constexpr void for_each_row(const VoxelGrid& /*grid*/, const BoxOverlap& overlap, Row&& row) {
  if (overlap.box == nullptr) return;
  const TickBox& box = *overlap.box;
  // Ratios are kept only where there is density, so never outside the volume.
  constexpr std::int32_t kBefore = kGradientReach;
  StoredRow stored{overlap.scratch.ratio + kRatioRowPad + kBefore, nullptr};
  const std::uint8_t* live = overlap.scratch.live;
  for (std::int32_t z = 0; z <= box.size.z; ++z) {
    const std::ptrdiff_t plane = std::ptrdiff_t{z + kBefore} * box.box.y + kBefore;
    stored.density = overlap.scratch.box + plane * box.box.x + kBefore;
    for (std::int32_t y = 0; y <= box.size.y; ++y) {
      if (*live++ != 0) {
        const VoxelIndex first{overlap.origin.x + kBefore, overlap.origin.y + kBefore + y,
                               overlap.origin.z + kBefore + z};
        row(first, box.size.x + 1, stored);
      }
      stored.ratio += box.row_lanes + kRatioRowPad;
      stored.density += box.box.x;
    }
  }
}

/// The same of the ratios of `overlap`.
template <class N, class Row>
constexpr void for_each_row(const VoxelGrid& grid, const OverlapBox<N>& overlap, Row&& row) {
  const VoxelBox box = overlap.box.clipped(grid.box());
  if (box.empty()) return;
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      const auto ratios = overlap.memory.subspan(overlap.at({box.lo.x, y, z}));
      row(VoxelIndex{box.lo.x, y, z}, box.hi.x - box.lo.x,
          [ratios](std::int32_t i) { return ratios[static_cast<std::size_t>(i)]; });
    }
  }
}

}  // namespace kerf
