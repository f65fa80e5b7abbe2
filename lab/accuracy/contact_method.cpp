// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/contact_method.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "controller/kernel/overlap.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/accuracy/reference_methods.hpp"

namespace kerf::accuracy {
namespace {

// The servo's methods in fixed point, each with the fastest kernels of this machine.

/// From stored gradients.
class GatherMethod final : public ContactMethod {
 public:
  GatherMethod(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool)
      : grid_(volume.grid),
        pitch_vox_(choice.pitch_vox),
        kernels_(**kernel_sets()),
        tool_(tool.offsets, SampleOrder::as_given),
        one_(kOneSample, SampleOrder::as_given),
        field_(field_of<FixedNumbers>(choice.kernel, volume)) {
    field_.resize(field_.size() + kFieldPad);
  }

  [[nodiscard]] Voxels tool_sum(Voxels centre) const override { return sum(tool_, centre); }
  [[nodiscard]] Voxels sample(Voxels at) const override { return sum(one_, at); }
  [[nodiscard]] std::size_t bytes_per_voxel() const override {
    return sizeof(Gradient<FixedNumbers>);
  }

 private:
  [[nodiscard]] Voxels sum(const SampleTool& tool, Voxels centre) const {
    const auto pose = pose_at<FixedNumbers>(centre, pitch_vox_);
    return full_densities<FixedNumbers>(
        gathered_contact(kernels_, tool.table(), grid_, field_, pose), FixedNumbers::kWeightOne);
  }

  VoxelGrid grid_;
  double pitch_vox_;
  const KernelSet& kernels_;
  SampleTool tool_, one_;
  std::vector<Gradient<FixedNumbers>> field_;
};

/// From the density alone, for round tools on the volume's lattice.
class AlignedMethod final : public ContactMethod {
 public:
  AlignedMethod(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool)
      : grid_(volume.grid),
        density_(volume.density),
        kernels_(**kernel_sets()),
        tool_(tool.offsets, exact_taps(choice.kernel), kernels_),
        one_(kOneSample, exact_taps(choice.kernel), kernels_) {
    memory_.hold(tool_.table().size, false);
  }

  [[nodiscard]] Voxels tool_sum(Voxels centre) const override { return sum(tool_, centre); }
  [[nodiscard]] Voxels sample(Voxels at) const override { return sum(one_, at); }
  [[nodiscard]] std::size_t bytes_per_voxel() const override { return 0; }

 private:
  [[nodiscard]] Voxels sum(const AlignedTool& tool, Voxels centre) const {
    const BoxScratch scratch = memory_.view();  // the tick keeps a reference
    const AlignedTick tick(kernels_, tool.table(), scratch, grid_, density_,
                           pose_at<FixedNumbers>(centre, 1));
    return full_densities<FixedNumbers>(tick.contact(), 1 << kAlignedKeptBits);
  }

  VoxelGrid grid_;
  mutable std::vector<Density> density_;  // a tick could mill it; contact does not
  const KernelSet& kernels_;
  AlignedTool tool_, one_;
  mutable BoxMemory memory_;
};

/// From the density alone, for any tool in any pose, as in scenes that cut. Its tick finds the
/// modification force as well.
class SplatMethod final : public ContactMethod {
 public:
  SplatMethod(const ContactChoice& choice, const AnalyticVolume& volume, const BallTool& tool)
      : grid_(volume.grid),
        pitch_vox_(choice.pitch_vox),
        density_(volume.density),
        kernels_(**kernel_sets()),
        taps_(exact_taps(choice.kernel)),
        tool_(tool.offsets, SampleOrder::scattered),
        one_(kOneSample, SampleOrder::scattered) {
    const std::size_t width = overlap_width(tool.size_pitches, tool.pitch_mm, volume.voxel_mm);
    memory_.hold({width, width, width}, tool.offsets.size());
  }

  [[nodiscard]] Voxels tool_sum(Voxels centre) const override { return sum(tool_, centre); }
  [[nodiscard]] Voxels sample(Voxels at) const override { return sum(one_, at); }
  [[nodiscard]] std::size_t bytes_per_voxel() const override { return 0; }

 private:
  [[nodiscard]] Voxels sum(const SampleTool& tool, Voxels centre) const {
    const SplatScratch scratch = memory_.view();  // the tick keeps references
    const SampleTable samples = tool.table();
    const SplatTick tick(kernels_, samples, taps_, scratch, grid_, density_,
                         pose_at<FixedNumbers>(centre, pitch_vox_));
    tick.copy();
    tick.splat();
    const int shift = taps_.shift - sum_shift(static_cast<std::size_t>(samples.count));
    const double unit = std::ldexp(FixedNumbers::kWeightOne, shift) / taps_.factor;
    return full_densities<FixedNumbers>(tick.press(FixedNumbers::kStepOne).contact, unit);
  }

  VoxelGrid grid_;
  double pitch_vox_;
  mutable std::vector<Density> density_;  // a tick could mill it; contact does not
  const KernelSet& kernels_;
  const ExactTaps& taps_;
  SampleTool tool_, one_;
  mutable SplatMemory memory_;
};

template <class N, class SumOf>
std::unique_ptr<ContactMethod> from_field(const ContactChoice& choice, const AnalyticVolume& volume,
                                          const BallTool& tool, SumOf sum_of) {
  return std::make_unique<FromField<N, SumOf>>(choice, volume, tool, sum_of);
}

}  // namespace

bool is_servos(const ContactChoice& choice) {
  return choice.storage != Storage::spline && choice.interpolation == Interpolation::trilinear &&
         choice.arithmetic != Arithmetic::q8 && choice.arithmetic != Arithmetic::q12;
}

BallTool ball_tool(double radius_mm, double pitch_mm) {
  SceneTool tool = make_tool("ball", "ball", {.pitch_mm = pitch_mm, .radius_mm = radius_mm});
  return {radius_mm, pitch_mm, tool.size_vox, std::move(tool.offsets)};
}

std::unique_ptr<ContactMethod> contact_method(const ContactChoice& choice,
                                              const AnalyticVolume& volume, const BallTool& tool) {
  if (choice.storage == Storage::aligned) {
    return std::make_unique<AlignedMethod>(choice, volume, tool);
  }
  if (choice.storage == Storage::splat) return std::make_unique<SplatMethod>(choice, volume, tool);
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
    case Arithmetic::float64:
      return from_field<DoubleNumbers>(choice, volume, tool, Gather<DoubleNumbers>{});
    case Arithmetic::q15:
      break;
  }
  return std::make_unique<GatherMethod>(choice, volume, tool);
}

Point force_share(const ContactMethod& method, const AnalyticVolume& volume, const BallTool& tool,
                  Point centre_mm) {
  const double a = tool.pitch_mm, r = tool.radius_mm;
  const double scale = -a * a * a / (volume.voxel_mm * std::numbers::pi * r * r);
  return scale * relabel<WorldSpace>(method.tool_sum(volume.voxel_from_mm(centre_mm)));
}

}  // namespace kerf::accuracy
