// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/aligned_table.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/method/matrices.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/plan/plan_preston.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/sum_to_force.hpp"

namespace kerf {

/// Smallest n with 2^n >= x; exact, unlike a logarithm, whose last bit differs between machines.
[[nodiscard]] inline int bits_of(double x) {
  const int floor = std::ilogb(x);
  return std::ldexp(1.0, floor) < x ? floor + 1 : floor;
}

/// Newtons per unit of an exact sum, as the loop's numbers hold it.
template <class N>
[[nodiscard]] SumToForce<N> sum_to_force(const Matrix& newtons_per_step, const SumUnit& sum) {
  SumToForce<N> map;
  if constexpr (N::kIsFixed) {
    // 38 bits of the largest sum are kept.
    map.pre_shift = std::max(0, bits_of(sum.largest) - 38);
    double largest = 0;
    for (const auto& row : newtons_per_step) {
      for (const double value : row) largest = std::max(largest, std::abs(value));
    }
    // The kept sum times `unit` newtons is the force in steps of 2^-16 N.
    const double unit = std::ldexp(sum.steps, map.pre_shift + 16);
    constexpr double kMantissaMax = 4194303;  // 22 bits
    constexpr int kMaxShift = 61;
    map.post_shift =
        largest == 0 ? 0 : std::clamp(std::ilogb(kMantissaMax / (largest * unit)), 0, kMaxShift);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        map.mantissa[i][j] = static_cast<std::int32_t>(
            std::clamp(std::round(std::ldexp(newtons_per_step[i][j] * unit, map.post_shift)),
                       -kMantissaMax, kMantissaMax));
      }
    }
  } else {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        map.row[i][j] = static_cast<typename N::Real>(newtons_per_step[i][j]);
      }
    }
  }
  return map;
}

/// See `ToolInVolume::reach_vox`: the farthest sample in any orientation, and the cells around it.
[[nodiscard]] inline std::array<std::int32_t, 3> reach_vox(const SceneTool& tool,
                                                           const VolumeImage& image) {
  constexpr double kCell = 2;  // beyond the sample, and before the centre's voxel
  double farthest = 0;         // half pitches
  for (const ToolOffset& offset : tool.offsets) {
    farthest = std::max(farthest, std::hypot(offset[0], offset[1], offset[2]));
  }
  std::array<std::int32_t, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double voxels = farthest * tool.pitch_mm / 2 / image.spacing_mm[axis];
    reach[axis] = static_cast<std::int32_t>(std::ceil(std::min(voxels, 1e6)) + kCell);
  }
  return reach;
}

/// Steps and forces of one tool in one volume, as its method wants them; `table` is that of the
/// method `aligned`.
template <class N>
[[nodiscard]] ToolInVolume<N> plan_tool(const ToolCase& what, const ToolMethod& method,
                                        const AlignedTable* table) {
  const auto& [scene, tool, volume, kernels] = what;
  const auto& h = volume.image.spacing_mm;
  const double a = tool.pitch_mm;
  const double voxel_mm3 = h[0] * h[1] * h[2];
  const Matrix rotation = matrix_of(volume.pose.orientation);
  ToolInVolume<N> in;
  in.method = method.step;
  in.reach_vox = reach_vox(tool, volume.image);
  in.aligned = table;
  in.voxel_from_pitch = rounded<typename N::Ratio, VoxelSpace, WorldSpace>(
      into_volume(rotation, {a / h[0], a / h[1], a / h[2]}));
  const Matrix unturned = unturned_steps(tool, volume);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) in.unturned_step[i][j] = step_of<N>(unturned[i][j]);
  }
  in.overlap_ratio = step_of<N>(a * a * a / voxel_mm3);
  in.rims_from_voxel = rims_from_voxel<N>(tool, volume);

  // World gradient per mm of density over its maximum: rotation * (1 / spacing) / 65535.
  const auto newtons = [&](double n_mm) {
    Matrix m{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        m[i][j] = scene.device.workspace_scale * n_mm * rotation[i][j] / (h[j] * kDensityMax);
      }
    }
    return m;
  };
  const SumUnits sums = method.sums(scene, tool.offsets.size());
  in.contact = sum_to_force<N>(newtons(scene.force.p0_n_per_mm2 * a * a * a), sums.contact);
  in.modification = sum_to_force<N>(newtons(scene.cut.p1_n_per_mm2 * voxel_mm3), sums.modification);
  return in;
}

}  // namespace kerf
