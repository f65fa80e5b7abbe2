// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/sampling.hpp"

// One tick of each method that works by overlap: `gather`, `aligned`, `splat`.

namespace kerf {

/// SUM over tool samples i of SUM over the corners j of its cell of phi_ij grad_j: the interpolated
/// gradients added up, in density steps per voxel times kWeightOne. The paper's contact force is
/// minus this, scaled by p0 a^3 (docs/forces.md 7.1).
///
/// A sample whose cell is not wholly inside the volume does not count. `field` holds one gradient
/// per voxel. Fixed: nothing is rounded but the weights, so the order of samples does not matter;
/// 2^30 per sample leaves room for 2^33 samples. Floating: samples in their order.
template <class N>
[[nodiscard]] constexpr SumVec<N> contact_sum(const VoxelGrid& grid,
                                              std::span<const Gradient<N>> field,
                                              std::span<const ToolOffset> offsets,
                                              const ToolPose<N>& pose) noexcept {
  using Sum = typename N::Sum;
  SumVec<N> sum{};
  for (const ToolOffset& offset : offsets) {
    const Cell<N> cell = cell_at<N>(sample_position(pose, offset));
    if (!cell.inside(grid)) continue;
    const TrilinearWeights<N> weights = trilinear_weights<N>(cell.weight);
    for (std::size_t edge = 0; edge < 4; ++edge) {
      const auto j = static_cast<std::int32_t>(edge & 1);
      const auto k = static_cast<std::int32_t>(edge >> 1);
      const std::size_t at = grid.index(cell.low.x, cell.low.y + j, cell.low.z + k);
      for (std::size_t i = 0; i < 2; ++i) {
        const Gradient<N>& g = field[at + i];
        const auto w = static_cast<Sum>(weights[2 * edge + i]);
        sum.x += w * static_cast<Sum>(g.x);
        sum.y += w * static_cast<Sum>(g.y);
        sum.z += w * static_cast<Sum>(g.z);
      }
    }
  }
  return sum;
}

/// The pose in plain integers, or none if no sample can be within a volume: so kernels may compute
/// positions in 32 bits.
struct NearPose {
  SamplePose pose{};
  bool near = false;
};

[[nodiscard]] inline NearPose near_pose(const ToolPose<FixedNumbers>& pose) noexcept {
  constexpr std::int32_t kFarthest = (kPositionLimitVox + kSampleReachVox) << Q16::kFractionBits;
  NearPose out;
  const Q16 centre[3] = {pose.centre_vox.x, pose.centre_vox.y, pose.centre_vox.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (centre[axis].raw() < -kFarthest || centre[axis].raw() > kFarthest) return out;
    out.pose.centre[axis] = centre[axis].raw();
    for (std::size_t k = 0; k < 3; ++k) out.pose.step[axis][k] = pose.step[axis][k];
  }
  out.near = true;
  return out;
}

/// `contact_sum` in the bits of the reference, whatever the kernels. `field` holds one gradient per
/// voxel and kFieldPad entries more. Work is bounded by the samples. Servo thread; no heap.
[[nodiscard]] inline SumVec<FixedNumbers> gathered_contact(
    const KernelSet& kernels, const SampleTable& samples, const VoxelGrid& grid,
    std::span<const Gradient<FixedNumbers>> field, const ToolPose<FixedNumbers>& pose) noexcept {
  const NearPose at = near_pose(pose);
  if (!at.near) return {};
  std::int64_t sum[3];
  kernels.gather(samples, at.pose, grid, &field.front().x, sum);
  return {sum[0], sum[1], sum[2]};
}

/// One tick of the method `aligned` on one volume: `contact` first, then `mill` at the same pose.
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
  /// Leaves the ratios alone.
  void cover() const noexcept {
    if (!outside_) kernels_.cover(table_, corner_weights().weight, scratch_);
  }
  /// The ratios that `press` or `cover` left.
  [[nodiscard]] BoxOverlap overlap() const noexcept {
    return outside_ ? BoxOverlap{} : BoxOverlap{&table_, scratch_, origin_};
  }

  struct Milled {
    SumVec<FixedNumbers> modification;  ///< `exact_modification_sum`
    Removed removed;
  };

  /// The modification sum, then the removal. `carry` has at least `table.row_lanes` entries; with
  /// fewer it cuts nothing and returns no force.
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

/// One tick of the method `splat` on one volume, stage by stage in this order: `copy`, `splat`,
/// `press`, `cut`. `splat_tick` runs them all.
///
/// Gives the bits of tests/kernel/definitions.hpp, overlap.hpp and milling.hpp, whatever the
/// kernels. Work is bounded by the samples and by the box that holds the tool in any orientation,
/// for which `scratch` has room. Far from the volume it does nothing. Servo thread; no heap.
class SplatTick {
 public:
  struct Felt {
    SumVec<FixedNumbers> contact;       ///< `splat_contact_sum`
    SumVec<FixedNumbers> modification;  ///< `exact_modification_sum`
  };

  /// Computes the positions of the samples.
  SplatTick(const KernelSet& kernels, const SampleTable& samples, const ExactTaps& taps,
            const SplatScratch& scratch, const VoxelGrid& grid, std::span<Density> density,
            const ToolPose<FixedNumbers>& pose) noexcept
      : kernels_(kernels), samples_(samples), scratch_(scratch), grid_(grid), density_(density) {
    const NearPose at = near_pose(pose);
    if (!at.near || samples.count == 0) return;
    VoxelIndex low, high;
    kernels.place(samples, at.pose, scratch, low, high);
    box_ = tick_box({high.x - low.x + 1, high.y - low.y + 1, high.z - low.z + 1}, taps,
                    static_cast<std::size_t>(samples.count));
    origin_ = {low.x - kGradientReach, low.y - kGradientReach, low.z - kGradientReach};
    const VoxelBox reached{
        origin_, {origin_.x + box_.box.x, origin_.y + box_.box.y, origin_.z + box_.box.z}};
    near_ = !reached.clipped(grid.box()).empty();
  }

  void copy() const noexcept {
    if (near_) kernels_.copy_box(box_, grid_, density_.data(), origin_, scratch_.tick);
  }
  void splat() const noexcept {
    if (near_) kernels_.splat(samples_, box_, origin_, scratch_);
  }
  /// `volume_ratio` is a^3 / V_voxel.
  [[nodiscard]] Felt press(std::int32_t volume_ratio) const noexcept {
    if (!near_) return {};
    std::int64_t contact[3], modification[3];
    kernels_.press_sums(box_, volume_ratio, scratch_, contact, modification);
    return {{contact[0], contact[1], contact[2]},
            {modification[0], modification[1], modification[2]}};
  }
  /// Leaves the ratios alone.
  void cover(std::int32_t volume_ratio) const noexcept {
    if (near_) kernels_.cover_sums(box_, volume_ratio, scratch_);
  }
  /// The ratios that `press` or `cover` left.
  [[nodiscard]] BoxOverlap overlap() const noexcept {
    return near_ ? BoxOverlap{&box_, scratch_.tick, origin_} : BoxOverlap{};
  }
  /// With a `carry` of less than the box's row_lanes nothing is cut.
  [[nodiscard]] Removed cut(const RemovalRate<FixedNumbers>& rate,
                            std::span<std::uint16_t> carry) const noexcept {
    if (!near_ || carry.size() < static_cast<std::size_t>(box_.row_lanes)) return {};
    return cut_box(kernels_, box_, scratch_.tick, grid_, density_, origin_, rate, carry);
  }

  [[nodiscard]] const TickBox& box() const noexcept { return box_; }

 private:
  const KernelSet& kernels_;
  SampleTable samples_;
  SplatScratch scratch_;
  const VoxelGrid& grid_;
  std::span<Density> density_;
  TickBox box_{};
  VoxelIndex origin_;  ///< low corner of the box
  bool near_ = false;
};

/// Sums and removal of one tick of the method `splat`.
struct SplatOutcome {
  SplatTick::Felt felt;
  Removed removed;
};

[[nodiscard]] inline SplatOutcome splat_tick(const KernelSet& kernels, const SampleTable& samples,
                                             const ExactTaps& taps, const SplatScratch& scratch,
                                             const VoxelGrid& grid, std::span<Density> density,
                                             const ToolPose<FixedNumbers>& pose,
                                             std::int32_t volume_ratio,
                                             const RemovalRate<FixedNumbers>& rate,
                                             std::span<std::uint16_t> carry) noexcept {
  const SplatTick tick(kernels, samples, taps, scratch, grid, density, pose);
  tick.copy();
  tick.splat();
  const SplatTick::Felt felt = tick.press(volume_ratio);
  return {felt, tick.cut(rate, carry)};
}

}  // namespace kerf
