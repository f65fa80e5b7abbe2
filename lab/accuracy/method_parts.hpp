// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "lab/accuracy/contact_method.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// What the contact methods share.

namespace kerf::accuracy {

using Voxels = VoxelVec<double>;
using Offsets = std::span<const ToolOffset>;

inline constexpr std::array<ToolOffset, 1> kOneSample{};

/// Unturned.
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

/// `unit`: what one density step per voxel is in the sum.
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

/// Q0.15 weights rounded half up to `Bits` fraction bits, still in Q0.15: the servo's lerp gives
/// with them the bits that a lerp of `Bits` would give.
template <int Bits>
[[nodiscard]] constexpr VoxelVec<FixedNumbers::Weight> coarse_weights(
    VoxelVec<FixedNumbers::Weight> w) noexcept {
  constexpr int kDropped = 15 - Bits;
  const auto coarse = [](FixedNumbers::Weight v) {
    return static_cast<FixedNumbers::Weight>(round_shift(v, kDropped)) * (1 << kDropped);
  };
  return {coarse(w.x), coarse(w.y), coarse(w.z)};
}

}  // namespace kerf::accuracy
