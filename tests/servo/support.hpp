// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "controller/scene/compile.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/device_report.hpp"
#include "hil/devmodel/omni_arm.hpp"

namespace kerf::test {

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

/// Solid below y = 0, touched with a 16^3 ball, nothing cut, motors configured.
inline Scene half_space_scene(int edge = 64) {
  Scene scene;
  scene.path = "test";
  scene.volumes.push_back(volume_of(edge, kVoxelMm, [](double, double y, double) { return y; }));
  scene.tools.push_back(ball(16));
  scene.cut.model = CutModel::none;
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  return scene;
}

/// A device that is where one puts it: counts from the emulator's own inverse kinematics.
class FakeArm {
 public:
  /// The stylus in the inkwell, buttons up, gimbal centred.
  [[nodiscard]] DeviceReport docked() {
    const auto& dock = omni::kDockRad;
    return report_of({dock[0], dock[1], dock[2]}, true);
  }
  /// The tip at a place of the device's workspace, to the nearest count.
  [[nodiscard]] DeviceReport at(double x_mm, double y_mm, double z_mm) {
    return report_of(arm_.joints_rad({x_mm, y_mm, z_mm}), false);
  }

 private:
  DeviceReport report_of(JointVec<double> q, bool docked) {
    const std::array<double, 3> joints{q.x, q.y, q.z};
    DeviceReport report;
    report.fresh = true;
    report.parked = docked;
    report.counter = ++counter_;
    report.wiper_a = report.wiper_b = {0x8000, 0x8000, 0x8000};
    for (std::size_t i = 0; i < 3; ++i) {
      const double turned = (joints[i] - omni::kDockRad[i]) / omni::kRadPerCount;
      const auto counts = kPowerUp[i] + omni::kEncoderSign[i] * std::lround(turned);
      report.encoder[i] = static_cast<std::int16_t>(counts);  // wraps as the device does
    }
    return report;
  }

  static constexpr std::array<long, 3> kPowerUp{32760, -32700, 32700};
  OmniArm arm_;
  std::uint32_t counter_ = 0;
};

inline constexpr int kDockTicks = 60;  ///< enough rest in the inkwell to be calibrated at 1 kHz

/// Docks, leaves the inkwell, waits there until the force is faded in.
inline void arm_at(Servo& servo, FakeArm& arm, double x_mm, double y_mm, double z_mm) {
  for (int tick = 0; tick < kDockTicks; ++tick) static_cast<void>(servo.step(arm.docked()));
  // The way from the inkwell is slow enough for the speed limit: held far away, then close.
  constexpr int kSteps = 200;
  const OmniArm geometry;
  const auto& d = omni::kDockRad;
  const auto start = geometry.tip_mm({d[0], d[1], d[2]});
  for (int i = 1; i <= kSteps; ++i) {
    const double s = double(i) / kSteps;
    static_cast<void>(
        servo.step(arm.at(start.x + s * (x_mm - start.x), start.y + s * (y_mm - start.y),
                          start.z + s * (z_mm - start.z))));
  }
}

[[nodiscard]] inline double length(const std::array<double, 3>& v) {
  return std::hypot(v[0], v[1], v[2]);
}

/// A compiled scene under an arm that was docked and led to `start_mm`, in the air above the flat.
struct ArmedServo {
  explicit ArmedServo(Scene& scene, const std::array<double, 3>& start_mm = {0, 5, 0})
      : servo(compile(scene)) {
    arm_at(*servo, arm, start_mm[0], start_mm[1], start_mm[2]);
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

  std::unique_ptr<Servo> servo;
  FakeArm arm;
};

}  // namespace kerf::test
