// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/volume/file/volume_image.hpp"

namespace kerf {

/// Layers of voxels kept around what is solid, so that gradients and the tool's first contact find
/// neighbours there.
inline constexpr std::int32_t kGuardVoxels = 3;

/// The part of `image` inside `box`, density and labels; the origin moves along, so every voxel
/// stays where it was. Where the box leaves the image there is air. Throws SceneError for an empty
/// box or one above the limits of volume_limits.hpp.
[[nodiscard]] VolumeImage crop(const VolumeImage& image, const VoxelBox& box);

/// The image with one layer of air around it where a voxel of at least `least` lies at its border:
/// a solid that ends there has a surface then. Else the image as it is.
[[nodiscard]] VolumeImage enclosed_in_air(VolumeImage image, Density least);

/// Crops to the tightest box around the voxels of at least `iso`, plus `guard` voxels on each side.
/// Throws SceneError where nothing is solid.
[[nodiscard]] VolumeImage crop_to_solid(const VolumeImage& image, Density iso,
                                        std::int32_t guard = kGuardVoxels);

/// A cropped image then ends in air: its last layer becomes air, the one before half of what it is.
/// The rest, and so the surface, stays as it is: what is solid lies `kGuardVoxels` from the border.
void fade_to_air(VolumeImage& image);

}  // namespace kerf
