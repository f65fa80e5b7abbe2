// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "lab/rig/kinematic_arm.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf::test {

using kerf::arm_at, kerf::KinematicOmni, kerf::kDockTicks;

inline constexpr double kVoxelMm = 0.125;

/// A ball of `diameter` voxels per axis, as `size_vox` makes it.
inline SceneTool ball(int diameter, double pitch_mm = kVoxelMm) {
  SceneTool tool;
  tool.name = "ball";
  tool.shape = "ball";
  tool.pitch_mm = pitch_mm;
  tool.radius_mm = diameter * pitch_mm / 2;
  tool.round = true;
  tool.size_vox = {diameter, diameter, diameter};
  const int end = diameter - 1;  // in half pitches
  for (int z = -end; z <= end; z += 2) {
    for (int y = -end; y <= end; y += 2) {
      for (int x = -end; x <= end; x += 2) {
        if (x * x + y * y + z * z > diameter * diameter) continue;
        tool.offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                static_cast<std::int16_t>(z)});
      }
    }
  }
  return tool;
}

/// A cube of voxels whose middle is the world origin, filled from a signed distance in mm (negative
/// inside) of world points, its edge spread over one voxel.
inline SceneVolume volume_of(int edge, double spacing_mm,
                             const std::function<double(double, double, double)>& signed_distance) {
  SceneVolume volume;
  volume.name = "test";
  volume.image.grid = {edge, edge, edge};
  volume.image.spacing_mm = {spacing_mm, spacing_mm, spacing_mm};
  const double corner = -spacing_mm * (edge - 1) / 2;
  volume.pose.position_mm = {corner, corner, corner};
  volume.image.density.reserve(volume.image.grid.voxel_count());
  for (int z = 0; z < edge; ++z) {
    for (int y = 0; y < edge; ++y) {
      for (int x = 0; x < edge; ++x) {
        const double sd = signed_distance(corner + x * spacing_mm, corner + y * spacing_mm,
                                          corner + z * spacing_mm);
        volume.image.density.push_back(static_cast<Density>(
            std::lround(std::clamp(0.5 - sd / spacing_mm, 0.0, 1.0) * kDensityMax)));
      }
    }
  }
  return volume;
}

/// Solid below y = 0, felt with a 16^3 ball by the default force, nothing cut, motors configured.
inline LoadedScene half_space_scene(int edge = 64) {
  LoadedScene scene;
  scene.path = "test";
  scene.volumes.push_back(volume_of(edge, kVoxelMm, [](double, double y, double) { return y; }));
  scene.tools.push_back(ball(16));
  scene.cut.model = CutModel::none;
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  return scene;
}

/// The same by the paper's force.
inline LoadedScene paper_scene(int edge = 64) {
  LoadedScene scene = half_space_scene(edge);
  scene.force.model = ForceModel::paper;
  return scene;
}

using vec3::length;

/// A compiled scene under an arm that was docked and led to `start_mm`, in the air above the flat.
struct ArmedServo {
  /// `ticks`: for each place on the way there, 1 per kHz of the rate.
  explicit ArmedServo(LoadedScene& scene, const std::array<double, 3>& start_mm = {0, 5, 0},
                      int ticks = 1)
      : servo(compile(scene)) {
    arm_at(*servo, arm, start_mm[0], start_mm[1], start_mm[2], ticks);
  }
  ServoOutput step(double x_mm, double y_mm, double z_mm) {
    return servo->step(arm.at(x_mm, y_mm, z_mm));
  }
  /// Steady output with the tip at a device place.
  ServoOutput settled(double x_mm, double y_mm, double z_mm) {
    ServoOutput out;
    for (int tick = 0; tick < 20; ++tick) out = step(x_mm, y_mm, z_mm);
    return out;
  }

  std::unique_ptr<AnyServo> servo;
  KinematicOmni arm;
};

}  // namespace kerf::test
