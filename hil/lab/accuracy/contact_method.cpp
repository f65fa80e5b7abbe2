// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/accuracy/contact_method.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "controller/kernel/aligned.hpp"
#include "controller/kernel/contact.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/tool_shapes.hpp"
#include "hil/lab/accuracy/coarse_weights.hpp"
#include "hil/lab/accuracy/spline.hpp"

namespace kerf::accuracy {
namespace {

using Voxels = VoxelVec<double>;
using Offsets = std::span<const ToolOffset>;

constexpr std::array<ToolOffset, 1> kOneSample{};

template <class N>
ToolPose<N> pose_at(Voxels centre, double pitch_vox) {
  using Real = typename N::Real;
  ToolPose<N> pose;
  pose.centre_vox = {Real(centre.x), Real(centre.y), Real(centre.z)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step = pitch_vox * double(N::kStepOne);
    if constexpr (N::kIsFixed) {
      pose.step[axis][axis] = static_cast<typename N::Step>(std::lround(step));
    } else {
      pose.step[axis][axis] = static_cast<typename N::Step>(step);
    }
  }
  return pose;
}

template <class N>
Voxels full_densities(SumVec<N> sum, double unit) {
  const double scale = 1 / (unit * kDensityMax);
  return {double(sum.x) * scale, double(sum.y) * scale, double(sum.z) * scale};
}

template <class N>
std::vector<Gradient<N>> field_of(GradientKernel kernel, const AnalyticVolume& volume) {
  std::vector<Gradient<N>> field(volume.grid.voxel_count());
  GradientScratch scratch;
  refresh_gradients<N>(kernel, volume.grid, volume.density, volume.grid.box(), field, scratch);
  return field;
}

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

  Voxels tool_sum(Voxels centre) const override { return sum(offsets_, centre); }
  Voxels sample(Voxels at) const override { return sum(kOneSample, at); }
  std::size_t bytes_per_voxel() const override { return sizeof(Gradient<N>); }

 private:
  Voxels sum(Offsets offsets, Voxels centre) const {
    const std::span<const Gradient<N>> field = field_;
    return sum_of_(volume_.grid, field, offsets, pose_at<N>(centre, pitch_vox_));
  }

  const AnalyticVolume& volume_;
  std::vector<ToolOffset> offsets_;
  double pitch_vox_;
  std::vector<Gradient<N>> field_;
  SumOf sum_of_;
};

/// The servo's plan `gather`.
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

/// The exact derivative of the density's B-spline: a force with a potential.
template <int Degree>
class DensitySpline final : public ContactMethod {
 public:
  DensitySpline(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool)
      : volume_(volume), offsets_(tool.offsets), pitch_vox_(choice.pitch_vox) {}

  Voxels tool_sum(Voxels centre) const override { return sum(offsets_, centre); }
  Voxels sample(Voxels at) const override { return sum(kOneSample, at); }
  std::size_t bytes_per_voxel() const override { return 0; }

 private:
  Voxels sum(Offsets offsets, Voxels centre) const {
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
        tool_(tool.offsets, aligned_taps(choice.kernel), kernels_),
        one_(kOneSample, aligned_taps(choice.kernel), kernels_) {
    memory_.hold(tool_.table().size, false);
  }

  Voxels tool_sum(Voxels centre) const override { return sum(tool_, centre); }
  Voxels sample(Voxels at) const override { return sum(one_, at); }
  std::size_t bytes_per_voxel() const override { return 0; }

 private:
  Voxels sum(const AlignedTool& tool, Voxels centre) const {
    const AlignedTick tick(kernels_, tool.table(), memory_.view(), grid_, density_,
                           pose_at<FixedNumbers>(centre, 1));
    return full_densities<FixedNumbers>(tick.contact(), 1 << kAlignedKeptBits);
  }

  VoxelGrid grid_;
  mutable std::vector<Density> density_;  // a tick could mill it; contact does not
  const AlignedKernels& kernels_;
  AlignedTool tool_, one_;
  mutable AlignedMemory memory_;
};

template <class N, class SumOf>
std::unique_ptr<ContactMethod> from_field(const ContactChoice& choice, const AnalyticVolume& volume,
                                          const BallTool& tool, SumOf sum_of) {
  return std::make_unique<FromField<N, SumOf>>(choice, volume, tool, sum_of);
}

}  // namespace

BallTool ball_tool(double radius_mm, double pitch_mm) {
  return {radius_mm, pitch_mm,
          make_tool("ball", "ball", {.pitch_mm = pitch_mm, .radius_mm = radius_mm}).offsets};
}

std::unique_ptr<ContactMethod> contact_method(const ContactChoice& choice,
                                              const AnalyticVolume& volume, const BallTool& tool) {
  if (choice.storage == Storage::aligned) return std::make_unique<Aligned>(choice, volume, tool);
  if (choice.storage == Storage::spline) {
    if (choice.interpolation == Interpolation::cubic) {
      return std::make_unique<DensitySpline<3>>(choice, volume, tool);
    }
    return std::make_unique<DensitySpline<2>>(choice, volume, tool);
  }
  const auto fixed = [&](auto sum_of) {
    return from_field<FixedNumbers>(choice, volume, tool, sum_of);
  };
  switch (choice.interpolation) {
    case Interpolation::nearest:
      return fixed(SplineBlend<0>{});
    case Interpolation::quadratic:
      return fixed(SplineBlend<2>{});
    case Interpolation::cubic:
      return fixed(SplineBlend<3>{});
    case Interpolation::trilinear:
      break;
  }
  switch (choice.arithmetic) {
    case Arithmetic::q8:
      return fixed(CoarseLerp<8>{});
    case Arithmetic::q12:
      return fixed(CoarseLerp<12>{});
    case Arithmetic::float32:
      return from_field<FloatNumbers>(choice, volume, tool, Gather<FloatNumbers>{});
    case Arithmetic::float64:
      return from_field<DoubleNumbers>(choice, volume, tool, Gather<DoubleNumbers>{});
    case Arithmetic::q15:
      break;
  }
  return fixed(Gather<FixedNumbers>{});
}

Point force_share(const ContactMethod& method, const AnalyticVolume& volume, const BallTool& tool,
                  Point centre_mm) {
  const double a = tool.pitch_mm, r = tool.radius_mm;
  const double scale = -a * a * a / (volume.voxel_mm * std::numbers::pi * r * r);
  return scale * relabel<WorldSpace>(method.tool_sum(volume.voxel_from_mm(centre_mm)));
}

}  // namespace kerf::accuracy
