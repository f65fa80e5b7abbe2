// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "controller/scene/force_maps.hpp"
#include "controller/scene/lattice.hpp"
#include "controller/scene/matrices.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// Steps and forces of one tool in one volume; `table` is the tool's for the plan `aligned`, or
/// nullptr for the plan `gather`.
template <class N>
[[nodiscard]] ToolInVolume<N> plan_tool(const Scene& scene, const SceneTool& tool,
                                        const SceneVolume& volume, const AlignedTable* table) {
  const auto& h = volume.image.spacing_mm;
  const double a = tool.pitch_mm;
  const double voxel_mm3 = h[0] * h[1] * h[2];
  const auto samples = static_cast<double>(tool.offsets.size());
  const Matrix rotation = matrix_of(volume.pose.orientation);
  ToolInVolume<N> in;
  in.aligned = table;
  in.voxel_from_pitch = rounded<typename N::Ratio, VoxelSpace, WorldSpace>(
      into_volume(rotation, {a / h[0], a / h[1], a / h[2]}));
  const Matrix unturned = unturned_steps(tool, volume);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) in.unturned_step[i][j] = step_of<N>(unturned[i][j]);
  }
  in.overlap_ratio = step_of<N>(a * a * a / voxel_mm3);

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
  in.contact =
      sum_to_force<N>(newtons(scene.force.p0_n_per_mm2 * a * a * a),
                      table != nullptr ? aligned_contact_unit(samples) : gathered_sum(samples));
  // Each voxel counts at most once, and the tool touches at most eight voxels per sample.
  in.modification =
      sum_to_force<N>(newtons(scene.cut.p1_n_per_mm2 * voxel_mm3),
                      table != nullptr ? aligned_modification_unit(table->taps, samples)
                                       : gathered_sum(8 * samples));
  return in;
}

}  // namespace kerf
