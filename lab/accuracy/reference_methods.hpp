// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/overlap_methods.hpp"
#include "lab/accuracy/contact_method.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"

/// Contact methods beside the servo's: splines of the density and of stored gradients, and coarse
/// weights.
namespace kerf::accuracy {

/// The uniform B-spline of `Degree` along one axis: the weights of the Degree + 1 voxels from `low`
/// at one place, and their derivatives. Degree 0 is the nearest voxel, 1 is linear; from 2 on the
/// blend is smooth (Degree - 1 times differentiable), and blurs by a variance of
/// (Degree + 1) / 12 voxel^2. In double: a reference, not a fast path.
template <int Degree>
struct SplineAxis {
  std::int32_t low;
  std::array<double, Degree + 1> value, slope;
};

template <int Degree>
[[nodiscard]] SplineAxis<Degree> spline_axis(double at) {
  static_assert(Degree >= 0 && Degree <= 3);
  // Even degrees are centred on a voxel, odd ones between two.
  const double middle = std::floor(Degree % 2 == 0 ? at + 0.5 : at);
  const double t = at - middle;
  const std::int32_t low = static_cast<std::int32_t>(middle) - Degree / 2;
  if constexpr (Degree == 0) {
    return {low, {1}, {0}};
  } else if constexpr (Degree == 1) {
    return {low, {1 - t, t}, {-1, 1}};
  } else if constexpr (Degree == 2) {
    const double a = 0.5 - t, b = 0.5 + t;
    return {low, {a * a / 2, 0.75 - t * t, b * b / 2}, {-a, -2 * t, b}};
  } else {
    const double s = 1 - t;
    return {low,
            {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
             (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6},
            {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2}};
  }
}

/// The tensor product of three axes: calls `tap(voxel index, x, y, z)` for each voxel around `at`
/// with its entries in the three axes. No call if one of them is outside the volume.
template <int Degree>
struct SplineCell {
  SplineAxis<Degree> x, y, z;

  explicit SplineCell(VoxelVec<double> at)
      : x(spline_axis<Degree>(at.x)), y(spline_axis<Degree>(at.y)), z(spline_axis<Degree>(at.z)) {}

  template <class Tap>
  void each(const VoxelGrid& grid, Tap&& tap) const {
    if (!grid.contains({x.low, y.low, z.low}) ||
        !grid.contains({x.low + Degree, y.low + Degree, z.low + Degree})) {
      return;
    }
    for (std::size_t k = 0; k <= Degree; ++k) {
      for (std::size_t j = 0; j <= Degree; ++j) {
        const std::size_t row = grid.index(x.low, y.low + static_cast<std::int32_t>(j),
                                           z.low + static_cast<std::int32_t>(k));
        for (std::size_t i = 0; i <= Degree; ++i) tap(row + i, i, j, k);
      }
    }
  }
};

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

/// Weights of `Bits` through the servo's lerp: a Q15 weight whose last bits are zero gives the
/// result of a narrower one. 8 bits of each interpolated value are kept.
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
