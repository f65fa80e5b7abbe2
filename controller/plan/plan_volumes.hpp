// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/matrices.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

/// Voxels per mm must fit the loop's number for it.
template <class N>
void check_spacing(const LoadedScene& scene, const SceneVolume& volume) {
  constexpr double kSmallestMm = 0.008;  // Ratio ends at 128
  const auto& h = volume.image.spacing_mm;
  const double smallest = std::min({h[0], h[1], h[2]});
  if (!N::kIsFixed || smallest >= kSmallestMm) return;
  throw SceneError(scene.path + ": volume " + volume.name + ": spacing_mm " +
                   std::to_string(smallest) +
                   " is below the 0.008 of fixed-point numbers; resample it, or set "
                   "servo.numeric = \"double\"");
}

/// Where one solid volume is and how to get into it.
template <class N>
[[nodiscard]] VolumePlan<N> plan_volume(const SceneVolume& volume, std::size_t scene_index) {
  using Real = typename N::Real;
  const Matrix rotation = matrix_of(volume.pose.orientation);
  const auto& h = volume.image.spacing_mm;
  const double largest = std::max({h[0], h[1], h[2]});
  VolumePlan<N> plan;
  plan.scene_index = scene_index;
  plan.grid = volume.image.grid;
  plan.iso = volume.iso;
  plan.position_mm = rounded<WorldVec<Real>, Real>(volume.pose.position_mm);
  plan.voxel_from_world = rounded<typename N::Ratio, VoxelSpace, WorldSpace>(
      into_volume(rotation, {1 / h[0], 1 / h[1], 1 / h[2]}));
  plan.normal_from_world = rounded<typename N::Unit, VoxelSpace, WorldSpace>(
      into_volume(rotation, {h[0] / largest, h[1] / largest, h[2] / largest}));
  plan.largest_spacing_mm = Real(largest);
  return plan;
}

/// The solid volumes of the scene, in its order. Throws SceneError where there is none, or one
/// whose voxels the loop's numbers cannot hold.
template <class N>
void plan_volumes(const LoadedScene& scene, ServoPlan<N>& plan) {
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    if (!scene.volumes[i].solid) continue;
    check_spacing<N>(scene, scene.volumes[i]);
    plan.volumes[plan.volume_count++] = plan_volume<N>(scene.volumes[i], i);
  }
  if (plan.volume_count == 0) {
    throw SceneError(scene.path +
                     ": no [[volume]] is solid; set solid = true for the one to touch");
  }
}

}  // namespace kerf
