// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "controller/input/load_error.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/servo/servo_plan.hpp"

// The solid volumes of a scene and its swept contact in the loop's numbers: frames, proxy,
// coupling. Load time.

namespace kerf {

/// Refuses a spacing whose voxels per mm do not fit the loop's number for it.
template <class N>
void check_spacing(const LoadedScene& scene, const SceneVolume& volume) {
  constexpr double kSmallestMm = 0.008;  // Ratio ends at 128
  const auto& h = volume.image.spacing_mm;
  const double smallest = std::min({h[0], h[1], h[2]});
  if (!N::kIsFixed || smallest >= kSmallestMm) return;
  throw LoadError(scene.path + ": volume " + volume.name + ": spacing_mm " +
                  std::to_string(smallest) +
                  " is below the 0.008 of fixed-point numbers; resample it, or set "
                  "servo.numeric = \"double\"");
}

/// Position of one solid volume, and the transforms into it.
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

/// The solid volumes of the scene, in its order. Throws LoadError if there is none, or one whose
/// voxels the loop's numbers cannot hold.
template <class N>
void plan_volumes(const LoadedScene& scene, ServoPlan<N>& plan) {
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    if (!scene.volumes[i].solid) continue;
    check_spacing<N>(scene, scene.volumes[i]);
    plan.volumes[plan.volume_count++] = plan_volume<N>(scene.volumes[i], i);
  }
  if (plan.volume_count == 0) {
    throw LoadError(scene.path + ": no [[volume]] is solid; set solid = true for the one to touch");
  }
}

/// Edge of the finest voxel of the solid volumes.
[[nodiscard]] inline double contact_unit_mm(const LoadedScene& scene) {
  double finest = std::numeric_limits<double>::max();
  for (const SceneVolume& volume : scene.volumes) {
    if (!volume.solid) continue;
    finest = std::min(
        finest, *std::min_element(volume.image.spacing_mm.begin(), volume.image.spacing_mm.end()));
  }
  return finest;
}

namespace contact_parts {

inline std::array<double, 3> middle_mm(const SceneVolume& volume) {
  const Matrix rotation = matrix_of(volume.pose.orientation);
  const VoxelGrid& grid = volume.image.grid;
  const std::array<double, 3> half{(grid.nx - 1) / 2.0, (grid.ny - 1) / 2.0, (grid.nz - 1) / 2.0};
  std::array<double, 3> at = volume.pose.position_mm;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      at[i] += rotation[i][j] * half[j] * volume.image.spacing_mm[j];
    }
  }
  return at;
}

}  // namespace contact_parts

/// Contact space. The origin is the middle of the first solid volume. Throws
/// LoadError for a volume so far from it that the proxy could not reach it.
template <class N>
void plan_contact(const LoadedScene& scene, ServoPlan<N>& plan) {
  using Real = typename N::Real;
  using Ratio = typename N::Ratio;
  ContactPlan<N>& contact = plan.contact;
  contact.swept = scene.force.model == ForceModel::proxy;
  if (!contact.swept) return;
  const double unit_mm = contact_unit_mm(scene);
  const auto first = contact_parts::middle_mm(scene.volumes[plan.volumes[0].scene_index]);
  for (std::size_t v = 1; v < plan.volume_count; ++v) {
    const SceneVolume& volume = scene.volumes[plan.volumes[v].scene_index];
    const auto middle = contact_parts::middle_mm(volume);
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::abs(middle[i] - first[i]) < kContactLimit * 0.5 * unit_mm) continue;
      throw LoadError(scene.path + ": volume " + volume.name +
                      " lies more than 4096 of the finest voxels from the first; bring them "
                      "together or set force.model = \"paper\"");
    }
  }
  contact.origin_mm = rounded<WorldVec<Real>, Real>(first);
  contact.units_per_mm = Ratio(1 / unit_mm);
  contact.mm_per_unit = Ratio(unit_mm);
  contact.device_mm_per_unit = Ratio(unit_mm / scene.device.workspace_scale);
}

/// How long the force of a program counts, rounded up to a tick.
[[nodiscard]] inline std::uint32_t stale_ticks(const LoadedScene& scene) {
  return static_cast<std::uint32_t>(std::ceil(scene.force.stale_ms * scene.servo.rate_hz / 1000));
}

template <class N>
[[nodiscard]] ExternalPlan<N> plan_external(const LoadedScene& scene) {
  return {.on = scene.force.model == ForceModel::external,
          .stale_ticks = stale_ticks(scene),
          .most_stiffness_n_per_mm = scene.force.stiffness_n_per_mm,
          .most_damping_ns_per_mm = scene.force.damping_ns_per_mm};
}

/// Frame of a volume in contact space.
template <class N>
[[nodiscard]] ContactFrame<N> contact_frame(const LoadedScene& scene, const SceneVolume& volume) {
  const double unit_mm = contact_unit_mm(scene);
  const auto& h = volume.image.spacing_mm;
  const Matrix rotation = matrix_of(volume.pose.orientation);
  const Matrix into = into_volume(rotation, {unit_mm / h[0], unit_mm / h[1], unit_mm / h[2]});
  const SceneVolume& first = *std::find_if(scene.volumes.begin(), scene.volumes.end(),
                                           [](const SceneVolume& v) { return v.solid; });
  const auto origin_mm = contact_parts::middle_mm(first);
  std::array<double, 3> origin_vox{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      origin_vox[i] += into[i][j] * (origin_mm[j] - volume.pose.position_mm[j]) / unit_mm;
    }
  }
  return {rounded<typename N::Ratio, VoxelSpace, ContactSpace>(into),
          rounded<VoxelVec<typename N::Real>, typename N::Real>(origin_vox)};
}

/// Motion of the proxy of a tool with these point shells.
template <class N>
void plan_proxy(const LoadedScene& scene, const SceneTool& tool, SweptTool<N>& swept) {
  constexpr double kRampNPerMs = 0.1;  // after a start inside of the solid: docs/theory.md 4.7
  const double n_per_unit =
      scene.force.stiffness_n_per_mm * contact_unit_mm(scene) / scene.device.workspace_scale;
  swept.follows_stylus = tool.turns && (!tool.round || swept.shaft.count > 0);
  double reach = std::max(1.0, static_cast<double>(swept.point_shell.reach));
  for (std::size_t i = 0; i < swept.shaft.count; ++i) {
    const ShaftPart<N>& part = swept.shaft.part[i];
    reach = std::max(reach, static_cast<double>(part.up + part.point_shell.reach));
  }
  swept.proxy = {
      .friction = typename N::Unit(scene.force.friction),
      .rotation_step = typename N::Unit(swept.follows_stylus ? rotation_step_of(reach) : 0.0),
      // At least a step of fixed point, else the ramp would never end.
      .ramp_per_tick = typename N::Real(
          std::max(kRampNPerMs * 1000 / scene.servo.rate_hz / n_per_unit, std::ldexp(1.0, -16)))};
}

}  // namespace kerf
