// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "controller/kernel/tool_pose.hpp"
#include "controller/kernel/trilinear.hpp"

namespace kerf {

/// How much of each voxel near the tool the tool covers, 0..kWeightOne: the paper's overlap ratio
/// (docs/theory.md 7.3).
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

/// Entries that `OverlapBox::memory` needs for this tool in this volume, in any orientation.
[[nodiscard]] inline std::size_t overlap_capacity(
    const std::array<std::int32_t, 3>& size_pitches, double pitch_mm,
    const std::array<double, 3>& spacing_mm) noexcept {
  return overlap_width(size_pitches, pitch_mm, spacing_mm[0]) *
         overlap_width(size_pitches, pitch_mm, spacing_mm[1]) *
         overlap_width(size_pitches, pitch_mm, spacing_mm[2]);
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

}  // namespace kerf
