// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/aligned_tool.hpp"
#include "controller/plan/force_maps.hpp"
#include "controller/plan/lattice.hpp"
#include "controller/plan/matrices.hpp"
#include "controller/plan/plan_preston.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// Steps and forces of one tool in one volume; `table` is the tool's for the plan `aligned`.
template <class N>
[[nodiscard]] ToolInVolume<N> plan_tool(const LoadedScene& scene, const SceneTool& tool,
                                        const SceneVolume& volume, Plan plan,
                                        const AlignedTable* table) {
  const auto& h = volume.image.spacing_mm;
  const double a = tool.pitch_mm;
  const double voxel_mm3 = h[0] * h[1] * h[2];
  const std::size_t samples = tool.offsets.size();
  const auto terms = static_cast<double>(samples);
  const Matrix rotation = matrix_of(volume.pose.orientation);
  ToolInVolume<N> in;
  in.plan = plan;
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
  const SumUnit exact = exact_sum_unit(exact_taps(scene.servo.kernel), samples);
  SumUnit contact = gathered_sum(terms);
  // Each voxel counts at most once, and the tool touches at most eight voxels per sample.
  SumUnit modification = gathered_sum(8 * terms);
  if (plan == Plan::aligned) contact = aligned_contact_unit(terms);
  if (plan == Plan::splat) contact = exact;
  if (plan != Plan::gather) modification = exact;
  in.contact = sum_to_force<N>(newtons(scene.force.p0_n_per_mm2 * a * a * a), contact);
  in.modification = sum_to_force<N>(newtons(scene.cut.p1_n_per_mm2 * voxel_mm3), modification);
  return in;
}

}  // namespace kerf
