// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/servo/servo_plan.hpp"
#include "shared/numeric/elementary.hpp"

// The tools of a scene in its volumes, and cutting by force, in the loop's numbers. Load time.

namespace kerf {

/// Rates at which force cuts `volume`, without its labels. A voxel without a label, and a volume
/// without labels, is cut as enamel.
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

/// The law by which force and speed of this tool cut.
template <class N>
[[nodiscard]] CutLaw<N> plan_law(const LoadedScene& scene, const SceneTool& tool) {
  const BurLaw& bur = tool.law;
  return cut_law<N>({.threshold_n = scene.cut.threshold_n,
                     .reference_n = scene.cut.reference_n,
                     .force_exponent = bur.force_exponent,
                     .speed_exponent = bur.speed_exponent,
                     .largest_n = bur.saturation_n,
                     .wear_half_n_s = bur.wear_half_n_s},
                    scene.servo.rate_hz);
}

/// For a `LoadPlane`.
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
      cut.voxel_fraction[v] = typename N::Unit(share).raw();
    } else {
      cut.voxel_fraction[v] = static_cast<CutBudget<N>>(share);
    }
  }
  return cut;
}

/// Smallest n with 2^n >= x; exact, unlike a logarithm, whose last bit differs between machines.
[[nodiscard]] inline int bits_of(double x) {
  const int floor = std::ilogb(x);
  return std::ldexp(1.0, floor) < x ? floor + 1 : floor;
}

/// Newtons per unit of an exact sum.
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
    farthest = std::max(farthest, hypotenuse(offset[0], offset[1], offset[2]));
  }
  std::array<std::int32_t, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double voxels = farthest * tool.pitch_mm / 2 / image.spacing_mm[axis];
    reach[axis] = static_cast<std::int32_t>(std::ceil(std::min(voxels, 1e6)) + kCell);
  }
  return reach;
}

/// Steps and forces of one tool in one volume, for its method; `table` is that of the method
/// `aligned`.
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
