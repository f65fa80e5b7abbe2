// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "controller/load/loaded_scene.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf::faults {

/// The direction out of the solid, from the voxels alone: from the middle of the voxels that a ball
/// of the tool's radius covers, to the ball's own middle. For a scene of one volume that nothing is
/// cut from, felt with a ball. `scene` outlives it.
class OutwardNormal {
 public:
  explicit OutwardNormal(const LoadedScene& scene);

  /// Of length 1, at a tip of the device; empty if the ball covers nothing, or its own middle, or
  /// if the scene is another one.
  [[nodiscard]] std::optional<DeviceVec<double>> at(DeviceVec<double> tip_mm) const;

  /// The ball covers nothing there.
  [[nodiscard]] bool is_free(DeviceVec<double> tip_mm) const { return covered(tip_mm).voxels == 0; }

  /// The distance that a ball may move at once, device mm, so that the voxels it covers there show
  /// the way by which it came: its radius. From farther off it may have passed through the solid,
  /// and the way out at that place is the one on the other side.
  [[nodiscard]] double reach_mm() const { return radius_mm_ / scene_.device.workspace_scale; }

 private:
  struct Covered {
    std::array<double, 3> sum{};  ///< from the ball's middle, mm along the volume's axes
    double voxels = 0;
  };
  [[nodiscard]] Covered covered(DeviceVec<double> tip_mm) const;

  const LoadedScene& scene_;
  const SceneVolume* volume_ = nullptr;  ///< none: another scene
  double radius_mm_ = 0;
  std::array<double, 9> axes_{};  ///< world from volume, row-major
};

}  // namespace kerf::faults
