// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/aligned_table.hpp"
#include "controller/kernel/cut.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap_rows.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/kernel/trilinear.hpp"

namespace kerf {

/// One tick of the method `aligned` on one volume: `contact` first, then `mill` of the same place.
///
/// Gives the bits of tests/kernel/definitions.hpp, overlap.hpp and milling.hpp, whatever the
/// kernels. Work is bounded by the tool's box and does not depend on pose or content. Servo thread;
/// no heap.
class AlignedTick {
 public:
  /// `table` was made for `kernels`; `scratch` has at least the table's sizes. The tool must be
  /// unrotated: only `pose.centre_vox` is used.
  AlignedTick(const KernelSet& kernels, const AlignedTable& table, const BoxScratch& scratch,
              const VoxelGrid& grid, std::span<Density> density,
              const ToolPose<FixedNumbers>& pose) noexcept
      : kernels_(kernels), table_(table), scratch_(scratch), grid_(grid), density_(density) {
    const auto lowest = [](Q16 centre, std::int16_t low) {
      constexpr std::int64_t kLimit = std::int64_t{kPositionLimitVox} << Q16::kFractionBits;
      const std::int64_t place = centre.raw() + low * (std::int64_t{1} << 15);
      return Q16::from_raw(static_cast<std::int32_t>(std::clamp(place, -kLimit, kLimit)));
    };
    const Cell<FixedNumbers> cell = cell_at<FixedNumbers>(
        {lowest(pose.centre_vox.x, table.low[0]), lowest(pose.centre_vox.y, table.low[1]),
         lowest(pose.centre_vox.z, table.low[2])});
    weight_ = cell.weight;
    origin_ = {cell.low.x - kGradientReach, cell.low.y - kGradientReach,
               cell.low.z - kGradientReach};
    const VoxelBox box{origin_,
                       {origin_.x + table.box.x, origin_.y + table.box.y, origin_.z + table.box.z}};
    outside_ = box.clipped(grid.box()).empty();
    if (!outside_) kernels.copy_box(table, grid, density.data(), origin_, scratch);
  }

  /// `aligned_contact_sum`: in density steps per voxel times 2^8.
  [[nodiscard]] SumVec<FixedNumbers> contact() const noexcept {
    if (outside_) return {};
    std::int64_t sum[3][8];
    kernels_.correlate(table_, scratch_.box, sum);
    const auto blended = [&](const std::int64_t(&axis)[8]) {
      std::array<std::int64_t, 8> corner{};
      for (std::size_t c = 0; c < 8; ++c) {
        corner[c] = kept_bits(table_.taps, axis[c]);
      }
      return trilinear<FixedNumbers, std::int64_t>(corner, weight_);
    };
    return {blended(sum[0]), blended(sum[1]), blended(sum[2])};
  }

  /// Leaves the ratios of the overlap in the scratch; `exact_modification_sum` of them.
  [[nodiscard]] SumVec<FixedNumbers> press() const noexcept {
    if (outside_) return {};
    std::int64_t sum[3];
    kernels_.press(table_, corner_weights().weight, scratch_, sum);
    return {sum[0], sum[1], sum[2]};
  }
  /// The ratios alone.
  void cover() const noexcept {
    if (!outside_) kernels_.cover(table_, corner_weights().weight, scratch_);
  }
  /// What `press` or `cover` left.
  [[nodiscard]] BoxOverlap overlap() const noexcept {
    return outside_ ? BoxOverlap{} : BoxOverlap{&table_, scratch_, origin_};
  }

  struct Milled {
    SumVec<FixedNumbers> modification;  ///< `exact_modification_sum`
    Removed removed;
  };

  /// The modification sum, then the removal. `carry` has at least `table.row_lanes` entries; with
  /// fewer nothing is cut or felt.
  [[nodiscard]] Milled mill(const RemovalRate<FixedNumbers>& rate,
                            std::span<std::uint16_t> carry) const noexcept {
    Milled milled;
    if (outside_ || carry.size() < static_cast<std::size_t>(table_.row_lanes)) return milled;
    milled.modification = press();
    milled.removed = cut_box(kernels_, table_, scratch_, grid_, density_, origin_, rate, carry);
    return milled;
  }

 private:
  struct CornerWeights {
    std::int32_t weight[8];
  };
  [[nodiscard]] CornerWeights corner_weights() const noexcept {
    const TrilinearWeights<FixedNumbers> corner = trilinear_weights<FixedNumbers>(weight_);
    CornerWeights weights;
    std::copy(corner.begin(), corner.end(), weights.weight);
    return weights;
  }

  const KernelSet& kernels_;
  const AlignedTable& table_;
  BoxScratch scratch_;
  const VoxelGrid& grid_;
  std::span<Density> density_;
  VoxelIndex origin_;  ///< low corner of the box
  VoxelVec<FixedNumbers::Weight> weight_;
  bool outside_ = false;
};

}  // namespace kerf
