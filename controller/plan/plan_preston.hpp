// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numbers>

#include "controller/kernel/covered_loads.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/matrices.hpp"
#include "controller/servo/servo_plan.hpp"

namespace kerf {

// What a scene says about cutting by force, in the loop's numbers. Load time only.

/// How force cuts `volume`, without its labels. Matter without a label, and a volume without
/// labels, is cut as enamel.
template <class N>
[[nodiscard]] PrestonPlan<N> plan_preston(const LoadedScene& scene, const SceneVolume& volume) {
  const auto& h = volume.image.spacing_mm;
  const double steps_per_mm3 = kDensityMax / (h[0] * h[1] * h[2]);
  const double enamel = scene.cut.machinability_mm3_per_s_n / scene.servo.rate_hz * steps_per_mm3;
  PrestonPlan<N> plan;
  plan.rate[0] = force_rate<N>(enamel);
  for (std::size_t m = 1; m < scene.materials.size(); ++m) {
    const Material& material = scene.materials[m];
    plan.forbidden[m] = material.forbidden;
    if (!material.forbidden) plan.rate[m] = force_rate<N>(enamel * material.machinability);
  }
  return plan;
}

/// From voxel edges to rim radii of the tool along the world's axes, for a `SpindleFrame`.
template <class N>
[[nodiscard]] Transform<typename N::Ratio, WorldSpace, VoxelSpace> rims_from_voxel(
    const SceneTool& tool, const SceneVolume& volume) {
  Matrix m = matrix_of(volume.pose.orientation);
  for (auto& row : m) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      row[axis] *= volume.image.spacing_mm[axis] / tool.radius_mm;
    }
  }
  return rounded<typename N::Ratio, WorldSpace, VoxelSpace>(m);
}

/// For a `BearingPlane`.
template <class N>
[[nodiscard]] typename N::Ratio bearing_steepness(const SceneTool& tool,
                                                  const ContactPlan<N>& contact) {
  const double rim = tool.radius_mm * static_cast<double>(contact.units_per_mm);
  return typename N::Ratio(tool.round ? 1 : std::clamp(rim, 1.0, kSteepest));
}

template <class N>
[[nodiscard]] SpindlePlan<N> plan_spindle(const LoadedScene& scene) {
  const SpindleSettings& spindle = scene.spindle;
  const double omega_per_s = spindle.speed_krpm * 1000 * 2 * std::numbers::pi / 60;
  // g mm^2 / s^2 is 10^-6 N mm.
  const double run_up_s = spindle.inertia_g_mm2 * 1e-6 * omega_per_s / spindle.stall_torque_n_mm;
  return spindle_plan<N>(spindle.speed_krpm / kReferenceSpeedKrpm, spindle.stall_torque_n_mm,
                         run_up_s, 1.0 / scene.servo.rate_hz);
}

template <class N>
[[nodiscard]] FrictionPlan<N> plan_friction(const LoadedScene& scene) {
  return friction_plan<N>(scene.cut.friction, 1.0 / scene.servo.rate_hz);
}

/// The whole cutting plan. `ForceCutMemory` adds the labels later.
template <class N>
[[nodiscard]] ForceCutPlan<N> plan_force_cut(const LoadedScene& scene, const ServoPlan<N>& plan) {
  ForceCutPlan<N> cut;
  cut.on = scene.cut.model == CutModel::preston;
  if (!cut.on) return cut;
  constexpr double kDeeperPerS = 100, kBackPerS = 1;  // units: there in 10 ms, back in a second
  cut.threshold_n = typename N::Real(scene.cut.threshold_n);
  cut.deeper_step = typename N::Real(kDeeperPerS / scene.servo.rate_hz);
  cut.back_step = typename N::Real(kBackPerS / scene.servo.rate_hz);
  cut.spindle = plan_spindle<N>(scene);
  cut.friction = plan_friction<N>(scene);
  std::array<double, kMaxVolumes> voxel_mm3{};
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const SceneVolume& volume = scene.volumes[plan.volumes[v].scene_index];
    const auto& h = volume.image.spacing_mm;
    voxel_mm3[v] = h[0] * h[1] * h[2];
    cut.volume[v] = plan_preston<N>(scene, volume);
  }
  const double largest = *std::max_element(voxel_mm3.begin(), voxel_mm3.end());
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const double share = voxel_mm3[v] / largest;
    if constexpr (N::kIsFixed) {
      cut.voxel_share[v] = typename N::Unit(share).raw();
    } else {
      cut.voxel_share[v] = static_cast<CutBudget<N>>(share);
    }
  }
  return cut;
}

}  // namespace kerf
