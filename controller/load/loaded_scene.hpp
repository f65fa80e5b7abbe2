// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "controller/scene/scene.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/device/identified_device.hpp"
#include "shared/numeric/linear_algebra.hpp"

// A scene after loading, and the geometry of its volumes.

namespace kerf {

/// Position in mm and orientation as a quaternion x, y, z, w of unit length.
struct Pose {
  std::array<double, 3> position_mm{0, 0, 0};
  std::array<double, 4> orientation{0, 0, 0, 1};
};

/// One [[volume]] after loading, windowing and cropping. `pose` takes volume-frame mm (voxel
/// (0,0,0) at the origin, axes along the voxel axes) to world.
struct SceneVolume {
  std::string name;
  std::string file;
  std::string note{};  ///< of the reading of its file (SourceVolume), or empty
  VolumeImage image{};
  Pose pose{};
  Density iso = 32768;
  bool solid = true;
  Noise noise{};                        ///< as estimated
  int denoised = 0;                     ///< passes made against it
  std::vector<std::string> proposal{};  ///< of --volume: "what=chosen" for each choice
  std::vector<Material> proposed{};     ///< the materials for it
  bool enclosed = false;  ///< not cropped, solid at its border: a layer of air was added
};

/// A scene after loading: all inputs of the controller, in double, checked. Load time only.
struct LoadedScene : SceneSettings {
  std::vector<SceneVolume> volumes;
  std::vector<SceneTool> tools;
  std::size_t active_tool = 0;
  std::size_t second_tool = 0;           ///< of the second arm
  std::vector<VolumeSpec> volume_specs;  ///< as written in the file and on the command line
  std::vector<ToolSpec> tool_specs;      ///< as written, with the sizes in effect
  /// Of `device.identified`; none: the figures of the personality. Changes no tick.
  std::optional<IdentifiedDevice> identified, second_identified;
};

[[nodiscard]] inline std::size_t arms_of(const SceneSettings& scene) noexcept {
  return scene.second ? 2 : 1;
}
[[nodiscard]] inline const DeviceSettings& device_of(const SceneSettings& scene,
                                                     std::size_t arm) noexcept {
  return arm == 0 ? scene.device : scene.second->device;
}

/// The scene as its second arm has it, without the volumes: for all that depends on a device, and
/// not on what it touches.
[[nodiscard]] LoadedScene second_arm_of(const LoadedScene& scene);

using Point3 = vec3::Vec;  ///< mm

/// World from source when a scene gives no orientation: the source's z axis points up (world y), so
/// that a scan of an upright patient is upright: (x, y, z) -> (x, z, -y).
inline constexpr Matrix3 kSourceStanding = {1, 0, 0, 0, 0, 1, 0, -1, 0};

/// Pose of a volume whose box has its middle at `middle_mm` in the world, rotated by `orientation`
/// (world from the source file's frame) after the directions of the file itself.
[[nodiscard]] Pose place_volume(const VolumeImage& image, const Matrix3& orientation,
                                const Point3& middle_mm);

/// Axis-parallel world box around a volume: all of its voxels, whole.
struct WorldBox {
  Point3 lo_mm, hi_mm;
};
[[nodiscard]] WorldBox world_box(const SceneVolume& volume);

/// First contact of a hand that comes down from +y: the highest point at which the density reaches
/// the volume's iso on the vertical line through the middle of its box, or, if that line hits
/// nothing, on the line through the solid voxel nearest to it in (x, z). Between voxels the density
/// is trilinear, outside it is 0.
///
/// The point is exact to 1/100 of the smallest voxel edge, and walls thinner than a quarter of that
/// edge may be missed on the first line. Throws LoadError when no voxel reaches iso.
[[nodiscard]] Point3 first_surface_from_above(const SceneVolume& volume);

}  // namespace kerf
