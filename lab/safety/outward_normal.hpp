// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "controller/load/loaded_scene.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf::faults {

/// The direction out of the solid, from the voxels alone: from the mean position of the solid
/// voxels that a ball covers to the ball's centre. The ball's radius is that of the tool and one
/// voxel. For a scene with one volume, a ball as tool and no cutting. `scene` outlives it.
class OutwardNormal {
 public:
  explicit OutwardNormal(const LoadedScene& scene);

  /// Of length 1, at a tip of the device. Empty if the ball covers nothing, if the mean position is
  /// within a tenth of the radius of its centre, or if the scene is not of that kind.
  [[nodiscard]] std::optional<DeviceVec<double>> at(DeviceVec<double> tip_mm) const;

  /// The ball covers nothing there.
  [[nodiscard]] bool is_free(DeviceVec<double> tip_mm) const { return covered(tip_mm).voxels == 0; }

  /// The ball's radius, device mm: the longest step after which the direction still points back to
  /// where the ball came from. After a longer one it may have passed through the solid, and the
  /// direction is that of the other side.
  [[nodiscard]] double reach_mm() const { return radius_mm_ / scene_.device.workspace_scale; }

 private:
  struct Covered {
    std::array<double, 3> sum{};  ///< from the ball's middle, mm along the volume's axes
    double voxels = 0;
  };
  [[nodiscard]] Covered covered(DeviceVec<double> tip_mm) const;

  const LoadedScene& scene_;
  const SceneVolume* volume_ = nullptr;  ///< null: a scene of another kind
  double radius_mm_ = 0;
  std::array<double, 9> axes_{};  ///< world from volume, row-major
};

}  // namespace kerf::faults
