// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/load/loaded_scene.hpp"
#include "shared/numeric/rotation.hpp"

namespace kerf {

using Point3 = vec3::Vec;  ///< mm

/// World from source when a scene gives no orientation: the source's z axis points up (world y), so
/// that a scan of a standing patient stands: (x, y, z) -> (x, z, -y).
inline constexpr Matrix3 kSourceStanding = {1, 0, 0, 0, 0, 1, 0, -1, 0};

/// Pose of a volume whose box has its middle at `middle_mm` in the world, turned by `orientation`
/// (world from the source file's frame) after the directions that the file itself has.
[[nodiscard]] Pose place_volume(const VolumeImage& image, const Matrix3& orientation,
                                const Point3& middle_mm);

/// Axis-parallel world box around a volume: all of its voxels, whole.
struct WorldBox {
  Point3 lo_mm, hi_mm;
};
[[nodiscard]] WorldBox world_box(const SceneVolume& volume);

/// Where a hand that comes down from +y first touches: the highest point at which the density
/// reaches the volume's iso on the vertical line through the middle of its box, or, where that line
/// meets nothing, on the line through the solid voxel nearest to it in (x, z). Between voxels the
/// density is trilinear, outside it is 0.
///
/// The place is exact to 1/100 of the smallest voxel edge, and walls thinner than a quarter of that
/// edge may be missed on the first line. Throws SceneError when no voxel reaches iso.
[[nodiscard]] Point3 first_surface_from_above(const SceneVolume& volume);

}  // namespace kerf
