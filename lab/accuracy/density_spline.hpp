// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "lab/accuracy/method_parts.hpp"
#include "lab/accuracy/spline.hpp"

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

}  // namespace kerf::accuracy
