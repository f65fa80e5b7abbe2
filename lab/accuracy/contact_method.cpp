// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/contact_method.hpp"

#include <numbers>
#include <utility>

#include "controller/tool/tool_shapes.hpp"
#include "lab/accuracy/servo_methods.hpp"
#include "lab/accuracy/spline.hpp"
#include "lab/accuracy/stored_gradients.hpp"

namespace kerf::accuracy {
namespace {

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
    case Arithmetic::float32:
      return from_field<FloatNumbers>(choice, volume, tool, Gather<FloatNumbers>{});
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
