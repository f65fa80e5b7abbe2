// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/contact.hpp"
#include "lab/accuracy/method_parts.hpp"
#include "lab/accuracy/spline.hpp"

namespace kerf::accuracy {

/// The tool's samples one by one, from the stored gradients: `sum_of(field, offsets, pose)`.
template <class N, class SumOf>
class FromField final : public ContactMethod {
 public:
  FromField(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool,
            SumOf sum_of)
      : volume_(volume),
        offsets_(tool.offsets),
        pitch_vox_(choice.pitch_vox),
        field_(field_of<N>(choice.kernel, volume)),
        sum_of_(sum_of) {}

  [[nodiscard]] Voxels tool_sum(Voxels centre) const override { return sum(offsets_, centre); }
  [[nodiscard]] Voxels sample(Voxels at) const override { return sum(kOneSample, at); }
  [[nodiscard]] std::size_t bytes_per_voxel() const override { return sizeof(Gradient<N>); }

 private:
  [[nodiscard]] Voxels sum(Offsets offsets, Voxels centre) const {
    const std::span<const Gradient<N>> field = field_;
    return sum_of_(volume_.grid, field, offsets, pose_at<N>(centre, pitch_vox_));
  }

  const AnalyticVolume& volume_;
  std::vector<ToolOffset> offsets_;
  double pitch_vox_;
  std::vector<Gradient<N>> field_;
  SumOf sum_of_;
};

/// The servo's method `gather` by its definition; fixed point has kernels for it.
template <class N>
struct Gather {
  Voxels operator()(const VoxelGrid& grid, std::span<const Gradient<N>> field, Offsets offsets,
                    const ToolPose<N>& pose) const {
    return full_densities<N>(contact_sum<N>(grid, field, offsets, pose), double(N::kWeightOne));
  }
};

/// Weights of `Bits` through the servo's lerp: a Q15 weight whose last bits are zero gives what a
/// narrower one would. 8 bits of each interpolated value are kept.
template <int Bits>
struct CoarseLerp {
  using N = FixedNumbers;

  Voxels operator()(const VoxelGrid& grid, std::span<const Gradient<N>> field, Offsets offsets,
                    const ToolPose<N>& pose) const {
    SumVec<N> sum{};
    for (const ToolOffset& offset : offsets) {
      const Cell<N> cell = cell_at<N>(sample_position(pose, offset));
      if (!cell.inside(grid)) continue;
      std::array<N::Sample, 8> x{}, y{}, z{};
      for (std::size_t c = 0; c < 8; ++c) {
        const auto bit = [&](std::size_t axis) { return static_cast<std::int32_t>(c >> axis & 1); };
        const Gradient<N>& g =
            field[grid.index(cell.low.x + bit(0), cell.low.y + bit(1), cell.low.z + bit(2))];
        x[c] = g.x * N::kSampleOne;
        y[c] = g.y * N::kSampleOne;
        z[c] = g.z * N::kSampleOne;
      }
      const VoxelVec<N::Weight> w = coarse_weights<Bits>(cell.weight);
      sum = sum + SumVec<N>{trilinear<N>(x, w), trilinear<N>(y, w), trilinear<N>(z, w)};
    }
    return full_densities<N>(sum, double(N::kSampleOne));
  }
};

/// The stored gradients blended by a B-spline.
template <int Degree>
struct SplineBlend {
  using N = FixedNumbers;

  Voxels operator()(const VoxelGrid& grid, std::span<const Gradient<N>> field, Offsets offsets,
                    const ToolPose<N>& pose) const {
    SumVec<DoubleNumbers> sum{};
    for (const ToolOffset& offset : offsets) {
      const auto at = sample_position(pose, offset);
      const SplineCell<Degree> cell({double(at.x), double(at.y), double(at.z)});
      cell.each(grid, [&](std::size_t voxel, std::size_t i, std::size_t j, std::size_t k) {
        const double w = cell.x.value[i] * cell.y.value[j] * cell.z.value[k];
        const Gradient<N>& g = field[voxel];
        sum = sum + w * Voxels{double(g.x), double(g.y), double(g.z)};
      });
    }
    return full_densities<DoubleNumbers>(sum, 1);
  }
};

}  // namespace kerf::accuracy
