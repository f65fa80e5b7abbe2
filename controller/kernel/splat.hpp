// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/cut.hpp"
#include "controller/kernel/gather.hpp"
#include "controller/kernel/overlap_rows.hpp"
#include "controller/kernel/splat_table.hpp"

namespace kerf {

/// One tick of the method `splat` on one volume, stage by stage in this order: `copy`, `splat`,
/// `press`, `cut`. `splat_tick` runs them all.
///
/// Gives the bits of tests/kernel/definitions.hpp, overlap.hpp and milling.hpp, whatever the
/// kernels. Work is bounded by the samples and by the box that holds the tool in any orientation,
/// for which `scratch` has room. Far from the volume nothing is done. Servo thread; no heap.
class SplatTick {
 public:
  struct Felt {
    SumVec<FixedNumbers> contact;       ///< `splat_contact_sum`
    SumVec<FixedNumbers> modification;  ///< `exact_modification_sum`
  };

  /// Places the samples.
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
  /// The ratios alone.
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

/// What one tick of the method `splat` feels and takes.
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
