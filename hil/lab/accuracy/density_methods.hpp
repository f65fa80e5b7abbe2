// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "controller/kernel/aligned.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "hil/lab/accuracy/method_parts.hpp"
#include "hil/lab/accuracy/spline.hpp"

// Methods that store nothing but the density.
namespace kerf::accuracy {

/// The exact derivative of the density's B-spline: a force with a potential.
template <int Degree>
class DensitySpline final : public ContactMethod {
 public:
  DensitySpline(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool)
      : volume_(volume), offsets_(tool.offsets), pitch_vox_(choice.pitch_vox) {}

  [[nodiscard]] Voxels tool_sum(Voxels centre) const override { return sum(offsets_, centre); }
  [[nodiscard]] Voxels sample(Voxels at) const override { return sum(kOneSample, at); }
  [[nodiscard]] std::size_t bytes_per_voxel() const override { return 0; }

 private:
  [[nodiscard]] Voxels sum(Offsets offsets, Voxels centre) const {
    const auto pose = pose_at<DoubleNumbers>(centre, pitch_vox_);
    SumVec<DoubleNumbers> sum{};
    for (const ToolOffset& offset : offsets) {
      const SplineCell<Degree> cell(sample_position(pose, offset));
      cell.each(volume_.grid, [&](std::size_t voxel, std::size_t i, std::size_t j, std::size_t k) {
        const double rho = volume_.density[voxel];
        sum.x += rho * cell.x.slope[i] * cell.y.value[j] * cell.z.value[k];
        sum.y += rho * cell.x.value[i] * cell.y.slope[j] * cell.z.value[k];
        sum.z += rho * cell.x.value[i] * cell.y.value[j] * cell.z.slope[k];
      });
    }
    return full_densities<DoubleNumbers>(sum, 1);
  }

  const AnalyticVolume& volume_;
  std::vector<ToolOffset> offsets_;
  double pitch_vox_;
};

/// The servo's plan `aligned` with the fastest kernels of this machine.
class Aligned final : public ContactMethod {
 public:
  Aligned(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool)
      : grid_(volume.grid),
        density_(volume.density),
        kernels_(**aligned_kernels()),
        tool_(tool.offsets, *aligned_taps(choice.kernel), kernels_),
        one_(kOneSample, *aligned_taps(choice.kernel), kernels_) {
    memory_.hold(tool_.table().size, false);
  }

  [[nodiscard]] Voxels tool_sum(Voxels centre) const override { return sum(tool_, centre); }
  [[nodiscard]] Voxels sample(Voxels at) const override { return sum(one_, at); }
  [[nodiscard]] std::size_t bytes_per_voxel() const override { return 0; }

 private:
  [[nodiscard]] Voxels sum(const AlignedTool& tool, Voxels centre) const {
    const AlignedScratch scratch = memory_.view();  // the tick keeps a reference
    const AlignedTick tick(kernels_, tool.table(), scratch, grid_, density_,
                           pose_at<FixedNumbers>(centre, 1));
    return full_densities<FixedNumbers>(tick.contact(), 1 << kAlignedKeptBits);
  }

  VoxelGrid grid_;
  mutable std::vector<Density> density_;  // a tick could mill it; contact does not
  const AlignedKernels& kernels_;
  AlignedTool tool_, one_;
  mutable AlignedMemory memory_;
};

}  // namespace kerf::accuracy
