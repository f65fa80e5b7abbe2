// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/sampling.hpp"

// How much of each voxel the tool covers, and the rows of these ratios.

namespace kerf {

/// The fraction of each voxel near the tool that the tool covers, 0..kWeightOne: the paper's
/// overlap ratio (docs/forces.md 7.3).
///
/// `memory` is the caller's, sized once with `overlap_capacity`; the rest is written by `overlap`.
/// The box may stick out of the volume by one voxel; read through `row` inside `box` only.
template <class N>
struct OverlapBox {
  std::span<typename N::Weight> memory;
  VoxelBox box;                    ///< what `memory` covers now, x fastest
  std::int32_t lane_zero_vox = 0;  ///< x of removal-carry lane 0: two below the tool's lowest cell

  /// Ratios of one row of the box, from x = box.lo.x on.
  [[nodiscard]] constexpr std::span<const typename N::Weight> row(std::int32_t y,
                                                                  std::int32_t z) const noexcept {
    return memory.subspan(at({box.lo.x, y, z}), static_cast<std::size_t>(box.hi.x - box.lo.x));
  }
  [[nodiscard]] constexpr std::size_t at(VoxelIndex v) const noexcept {
    const VoxelIndex size = box.extent();
    return VoxelGrid{size.x, size.y, size.z}.index(v.x - box.lo.x, v.y - box.lo.y, v.z - box.lo.z);
  }
};

/// Widest box of voxels, on one axis, that a tool can touch in any orientation: its diagonal, and
/// room for the cells at both ends. `size_pitches` counts pitches per tool axis. Load time.
[[nodiscard]] inline std::size_t overlap_width(const std::array<std::int32_t, 3>& size_pitches,
                                               double pitch_mm, double spacing_mm) noexcept {
  double square = 0;
  for (const std::int32_t size : size_pitches) square += double(size) * double(size);
  return static_cast<std::size_t>(square_root(square) * pitch_mm / spacing_mm) + 4;
}

/// Entries that `OverlapBox::memory` needs for this tool in this volume, in any orientation. Only
/// cells that touch the volume count, so the box sticks out of it by at most one voxel at each end.
[[nodiscard]] inline std::size_t overlap_capacity(
    const VoxelGrid& grid, const std::array<std::int32_t, 3>& size_pitches, double pitch_mm,
    const std::array<double, 3>& spacing_mm) noexcept {
  const auto width = [&](std::size_t axis, std::int32_t voxels) {
    return std::min(overlap_width(size_pitches, pitch_mm, spacing_mm[axis]),
                    static_cast<std::size_t>(voxels) + 2);
  };
  return width(0, grid.nx) * width(1, grid.ny) * width(2, grid.nz);
}

namespace detail {

/// Sum of weights, at most the end of the range. All are positive, so the order does not matter.
template <class N>
[[nodiscard]] constexpr typename N::Weight add_weight(typename N::Weight sum,
                                                      typename N::Weight w) noexcept {
  if constexpr (N::kIsFixed) {
    constexpr auto kMax = std::numeric_limits<typename N::Weight>::max();
    return sum > kMax - w ? kMax : sum + w;
  } else {
    return sum + w;
  }
}

/// min(1, volume_ratio * sum).
template <class N>
[[nodiscard]] constexpr typename N::Weight overlap_ratio(typename N::Weight sum,
                                                         typename N::Step volume_ratio) noexcept {
  using Weight = typename N::Weight;
  if (volume_ratio == N::kStepOne) return std::min(sum, N::kWeightOne);
  if constexpr (N::kIsFixed) {
    const std::int64_t scaled = round_shift(std::int64_t{sum} * volume_ratio, 20);
    return static_cast<Weight>(std::min(scaled, std::int64_t{N::kWeightOne}));
  } else {
    return std::min(sum * volume_ratio, N::kWeightOne);
  }
}

}  // namespace detail

/// c_j = min(1, volume_ratio * SUM over tool samples i of phi_ij) for every voxel j that the tool
/// touches, before any density changes. `volume_ratio` is a^3 / V_voxel: pitch cubed over the
/// volume of a voxel; kStepOne skips the product.
///
/// Writes `scratch` and returns the part of its box inside the volume, empty when the tool is
/// outside. A sample beyond the border still covers the border voxels that its cell reaches. A box
/// larger than `scratch.memory` covers nothing: the scene sizes the memory for any orientation.
template <class N>
constexpr VoxelBox overlap(const VoxelGrid& grid, std::span<const ToolOffset> offsets,
                           const ToolPose<N>& pose, typename N::Step volume_ratio,
                           OverlapBox<N>& scratch) noexcept {
  scratch.box = {};
  std::int32_t lowest_x = kPositionLimitVox;
  VoxelBox box;
  for (const ToolOffset& offset : offsets) {
    const Cell<N> cell = cell_at<N>(sample_position(pose, offset));
    lowest_x = std::min(lowest_x, cell.low.x);
    if (!cell.touches(grid)) continue;
    box = box.united({cell.low, {cell.low.x + 2, cell.low.y + 2, cell.low.z + 2}});
  }
  const VoxelIndex size = box.extent();
  const std::size_t count = VoxelGrid{size.x, size.y, size.z}.voxel_count();
  if (count == 0 || count > scratch.memory.size()) return {};
  scratch.box = box;
  scratch.lane_zero_vox = lowest_x - 2;

  const std::span<typename N::Weight> sums = scratch.memory.first(count);
  for (auto& sum : sums) sum = {};
  const auto row = static_cast<std::size_t>(size.x);
  const auto plane = row * static_cast<std::size_t>(size.y);
  for (const ToolOffset& offset : offsets) {
    const Cell<N> cell = cell_at<N>(sample_position(pose, offset));
    if (!cell.touches(grid)) continue;
    const TrilinearWeights<N> weights = trilinear_weights<N>(cell.weight);
    const std::size_t low = scratch.at(cell.low);
    for (std::size_t c = 0; c < 8; ++c) {
      auto& sum = sums[low + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * plane];
      sum = detail::add_weight<N>(sum, weights[c]);
    }
  }
  for (auto& sum : sums) sum = detail::overlap_ratio<N>(sum, volume_ratio);
  return box.clipped(grid.box());
}

/// The overlap ratios that `press` of the methods `aligned` and `splat` left in the scratch, until
/// the next tick uses it; nothing if the tool is away from the volume.
struct BoxOverlap {
  const TickBox* box = nullptr;
  BoxScratch scratch;
  VoxelIndex origin;  ///< low corner of the box
};

/// A row of it: the ratio of voxel i from the first on along x, 0..kWeightOne.
struct StoredRow {
  const std::int16_t* ratio;    ///< negative
  const std::int16_t* density;  ///< less 2^15

  [[nodiscard]] constexpr std::int32_t operator()(std::int32_t i) const noexcept {
    return -std::int32_t{ratio[i]};
  }
};

/// Calls `row(first, count, ratio)` for every row of the overlap inside the volume, in z, y order:
/// `ratio(i)` is the ratio of voxel `first` + i along x, 0..kWeightOne. Rows without an overlap may
/// be left out.
template <class Row>
constexpr void for_each_row(const VoxelGrid& /*grid*/, const BoxOverlap& overlap, Row&& row) {
  if (overlap.box == nullptr) return;
  const TickBox& box = *overlap.box;
  // Ratios are kept only for voxels with density, so never outside the volume.
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

/// Calls `row` for each row of the voxels whose ratios are in `overlap`.
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
